"""Numbers, priors and names in the form in which people read them."""

import math
from typing import TypeGuard

from hdcal.data.prior import FAMILIES, Prior
from hdcal.data.theory_names import SPRING
from hdcal.quantities import FORCE, Quantities

# Parameter -> (label, unit shown, factor from code units).
_PARAMETERS: dict[str, tuple[str, str, float]] = {
    "K": ("influence coefficient K", "1", 1.0),
    "E0": ("Young's modulus E₀", "GPa", 1e-3),
    "alpha": ("loss of modulus per kelvin α", "1/K", 1.0),
    "force_offset": ("{load} offset b", "N", 1.0),
    "deformation_offset": ("{displacement} offset ω₀", "mm", 1.0),
    "sigma": ("reading noise σ", "N", 1.0),
    "force_gain": ("gain of the {load} gauge", "%", 100.0),
    "deformation_gain": ("gain of the displacement gauge", "%", 100.0),
    "temperature_offset": ("offset of the thermometer", "K", 1.0),
    "run_offset_sd": ("sd of zeros between runs", "N", 1.0),
    "specimen_sd": ("relative sd of stiffness between gears", "1", 1.0),
    "noise_correlation": ("correlation of neighbouring readings", "1", 1.0),
    "gap_sd": ("size of the discrepancy", "N", 1.0),
    "gap_length": ("relative length scale of the discrepancy", "1", 1.0),
    "mass": ("moved mass m", "kg", 1e3),
    "damping_ratio": ("damping ratio ζ", "1", 1.0),
    "initial_deformation": ("{displacement} at the first row", "mm", 1.0),
    "initial_velocity": ("speed at the first row", "mm/s", 1.0),
    "deformation_sigma": ("noise of the {displacement} reading", "mm", 1.0),
}
# Effects whose names are not words of a sentence.
_EFFECTS = {
    "coulomb_friction": "Coulomb friction",
    "heteroscedastic_noise": "noise that grows with the load",
}
UNITS = {name: (unit, factor) for name, (_, unit, factor) in _PARAMETERS.items()}
_FAMILY_WORDS = {
    "fixed": "exactly {0}{unit}",
    "normal": "{0} ± {1}{unit} (1 sd)",
    "lognormal": "{0}{unit}, times or divided by {1} (1 sd)",
    "half_normal": "half-normal, {0}{unit} (1 sd)",
    "uniform": "uniform from {0} to {1}{unit}",
    "beta": "beta({0}, {1})",
}
# Numbers of the families that have no unit.
_DIMENSIONLESS = {"log_sd", "a", "b"}
# A relative width below this is rounding error.
_ROUNDING = 1e-12


def number(value: float | None, width: float | None = None) -> str:
    """Return a number with three digits of its interval's width; None is a dash."""
    if not known(value):
        return "–"
    if not width or not math.isfinite(width) or width < _ROUNDING * abs(value):
        return digits(value, 4)
    place = _place(width)
    if abs(value) >= 1e6 or place < -8:
        decimals = max(2, _place(value) - place + 2)
        return f"{value:.{decimals}e}"
    # z: a rounded zero has no sign.
    return f"{value:z.{max(0, 2 - place)}f}"


def digits(value: float, count: int = 2) -> str:
    """Return a number with so many significant digits; an integer keeps all of its own.

    An uncertainty has two (GUM 7.2.6). Only from a million on it has an exponent.
    """
    whole = abs(value) < 1e6 and round(abs(value)) >= 10**count
    return f"{value:.0f}" if whole else f"{value:.{count}g}"


def _place(value: float) -> int:
    """Return the power of ten of a number's first digit."""
    return math.floor(math.log10(abs(value))) if value else 0


def known(value: float | None) -> TypeGuard[float]:
    """Return whether there is a finite number."""
    return value is not None and math.isfinite(value)


def unit(name: str) -> str:
    """Return a unit as it is written after a number."""
    return {"1": "", "degC": "°C", "C": "°C"}.get(name, name)


def prior_words(name: str, prior: Prior, units: Quantities = FORCE) -> str:
    """Return a prior in words, in the units of the summary."""
    shown, factor = UNITS.get(name, (prior.unit, 1.0))
    texts = []
    for part, value in zip(FAMILIES[prior.family], prior.numbers, strict=True):
        plain = float(value) * (1.0 if part in _DIMENSIONLESS else factor)
        log = part == "log_sd"
        texts.append(f"{math.exp(plain):.3g}" if log else f"{plain:.4g}")
    after = f" {unit(units.unit(shown))}".rstrip()
    return _FAMILY_WORDS[prior.family].format(*texts, unit=after)


def label(name: str, theory: str = "", units: Quantities = FORCE) -> str:
    """Return the label of an effect, or of a parameter under a theory."""
    if name == "K" and theory == SPRING:
        return f"{units.stiffness} K"
    effect, *parameter = name.split(".", 1)
    if name not in _PARAMETERS:
        return ": ".join([_EFFECTS.get(effect, effect), *parameter]).replace("_", " ")
    text = _PARAMETERS[name][0]
    return text.format(load=units.load, displacement=units.displacement)


def capital(text: str) -> str:
    """Return a sentence with a capital first letter."""
    return text[:1].upper() + text[1:]


_HYPOTHESES = {"none": "no gap", "unknown": "something outside the library"}


def hypothesis(name: str) -> str:
    """Return a hypothesis in words: `a+b` is a and b."""
    return " and ".join(_HYPOTHESES.get(part, label(part)) for part in name.split("+"))


def percent(share: float | None) -> str:
    """Return a share or probability in %, none of them as certain."""
    if not known(share):
        return "–"
    if 0.995 <= share < 1.0 + 1e-9:
        return "> 99 %"
    if 0.0 <= share < 0.005:
        return "< 1 %"
    return f"{round(100.0 * share)} %"


def load(value: float | None, units: Quantities = FORCE) -> str:
    """Return a force or torque with two significant digits."""
    if not known(value):
        return f"– {units.load_unit}"
    return f"{digits(value)} {units.load_unit}"
