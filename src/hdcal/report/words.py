"""Numbers, priors and names in the form in which people read them."""

import math
from typing import TypeGuard

from hdcal.data.prior import FAMILIES, Prior
from hdcal.data.theory_names import SPRING
from hdcal.quantities import FORCE, Quantities
from hdcal.report.units import UNITS

LABELS = {
    "K": "influence coefficient K",
    "E0": "Young's modulus E₀",
    "alpha": "loss of modulus per kelvin α",
    "force_offset": "{load} offset b",
    "deformation_offset": "{displacement} offset ω₀",
    "sigma": "reading noise σ",
    "force_gain": "gain of the {load} gauge",
    "deformation_gain": "gain of the displacement gauge",
    "temperature_offset": "offset of the thermometer",
    "run_offset_sd": "spread of zeros between runs",
    "specimen_sd": "spread of stiffness between gears",
    "noise_correlation": "correlation of neighbouring readings",
    "gap_sd": "size of the leftover discrepancy",
    "gap_length": "length of the leftover discrepancy",
    "mass": "moved mass m",
    "damping_ratio": "damping ratio ζ",
    "initial_deformation": "{displacement} at the first row",
    "initial_velocity": "speed at the first row",
    "deformation_sigma": "noise of the {displacement} reading",
}
_FAMILY_WORDS = {
    "fixed": "exactly {0}",
    "normal": "{0} ± {1}",
    "lognormal": "{0}, a factor of {1} either way",
    "half_normal": "0 to about {0}",
    "uniform": "anything from {0} to {1}",
    "beta": "beta({0}, {1})",
}
# Those of the families' numbers that carry no unit.
_PURE = {"log_sd", "a", "b"}
# Relative to a number, what doubles that are the same may differ by once computed.
_ROUNDING = 1e-12


def number(value: float | None, width: float | None = None) -> str:
    """Return a number with the digits that its uncertainty leaves meaningful.

    Args:
        value: what to write; None is a dash.
        width: its interval's width; three digits of it are kept.
    """
    if not known(value):
        return "–"
    # A width that is nothing but rounding of the last digits is none.
    if not width or not math.isfinite(width) or width < _ROUNDING * abs(value):
        return f"{value:.4g}"
    place = _place(width)
    if abs(value) >= 1e6 or place < -8:
        digits = max(2, _place(value) - place + 2)
        return f"{value:.{digits}e}"
    # What rounds to nought has no sign.
    return f"{value:z.{max(0, 2 - place)}f}"


def _place(value: float) -> int:
    """Return the power of ten of a number's first digit."""
    return math.floor(math.log10(abs(value))) if value else 0


def known(value: float | None) -> TypeGuard[float]:
    """Tell whether there is a number."""
    return value is not None and math.isfinite(value)


def unit(name: str) -> str:
    """Return a unit as it is written behind a number."""
    return {"1": "", "degC": "°C", "C": "°C"}.get(name, name)


def with_unit(text: str, name: str) -> str:
    """Return a number's text with its unit behind it."""
    return f"{text} {unit(name)}".rstrip()


def prior_words(name: str, prior: Prior, units: Quantities = FORCE) -> str:
    """Return a prior in words, in the units of the summary."""
    shown, factor = UNITS.get(name, (prior.unit, 1.0))
    shown = units.unit(shown)
    texts = []
    for part, value in zip(FAMILIES[prior.family], prior.numbers, strict=True):
        plain = float(value) * (1.0 if part in _PURE else factor)
        if part == "log_sd":
            plain = math.exp(plain)
        texts.append(f"{plain:.3g}" if part == "log_sd" else f"{plain:.4g}")
    return with_unit(_FAMILY_WORDS[prior.family].format(*texts), shown)


def label(name: str, theory: str = "", units: Quantities = FORCE) -> str:
    """Return what a parameter is called on paper, under some theory."""
    if name == "K" and theory == SPRING:
        return f"{units.stiffness} K"
    effect, dot, parameter = name.partition(".")
    if dot:
        return f"{effect}: {parameter}".replace("_", " ")
    named = LABELS.get(name, name.replace("_", " "))
    return named.format(load=units.load, displacement=units.displacement)


def capital(text: str) -> str:
    """Return a sentence with its first letter capital, the others as they are."""
    return text[:1].upper() + text[1:]


_HYPOTHESES = {"none": "no gap", "unknown": "something outside the library"}


def hypothesis(name: str) -> str:
    """Return a hypothesis as people say it: `a+b` is a and b."""
    return " and ".join(_HYPOTHESES.get(part, label(part)) for part in name.split("+"))


def percent(share: float | None) -> str:
    """Return a share or probability; never a certainty that nobody has."""
    if not known(share):
        return "–"
    if 0.995 <= share < 1.0 + 1e-9:
        return "> 99 %"
    if 0.0 <= share < 0.005:
        return "< 1 %"
    return f"{round(100.0 * share)} %"


def load(value: float | None, units: Quantities = FORCE) -> str:
    """Return a force or torque with two digits, or all those before the point."""
    if not known(value):
        return f"– {units.load_unit}"
    rounded = float(f"{value:.2g}")
    text = f"{value:.0f}" if abs(rounded) >= 10.0 else f"{rounded:g}"
    return f"{text} {units.load_unit}"
