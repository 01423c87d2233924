"""What a design comes to, in sentences for somebody who designs gears."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from hdcal.design.answer import (
    CandidateAnswer,
    ChosenSpring,
    DesignAnswer,
    GeneratorAnswer,
    InverseAnswer,
    StressAnswer,
)
from hdcal.design.design_draws import DesignDraws
from hdcal.prediction.engine.conditions import NEAR_K, NEAR_MM
from hdcal.prediction.engine.loading_sense import ends_along, interval_along
from hdcal.prediction.engine.sizes import SIZES
from hdcal.prediction.margin.result import FAR
from hdcal.report.words import estimate, number, percent

_FAR_OUT = (
    " So far out the answer rests on how fast such a bend may grow: test there before "
    "you rely on it."
)


def as_known(found: DesignAnswer, sentence: str) -> str:
    """Return a sentence that says so where no gear was measured."""
    if found.basis == "posterior":
        return sentence
    return f"Prior only, no gear was measured: {sentence}"


def next_step(found: DesignAnswer) -> str | None:
    """Return what to do with a design, in one sentence."""
    if found.basis == "prior":
        return "Measure a gear and calibrate it: until then this is belief."
    if isinstance(found, GeneratorAnswer):
        return (
            f"Set the free end of a spring of {number(found.spring.rate_N_per_mm)} "
            f"N/mm {_free_end(found)}."
        )
    if isinstance(found, InverseAnswer) and found.as_tested:
        return "No change is needed: the tested gear keeps the limits as it is."
    if isinstance(found, InverseAnswer):
        return "Make one such gear and test it: K is carried over to its sizes."
    return None


def generator_headline(found: GeneratorAnswer) -> str:
    """Return which spring keeps the window, in one sentence."""
    spring, (low, high) = found.spring, found.asked.window_mm
    return as_known(
        found,
        f"A spring of {number(spring.rate_N_per_mm)} N/mm keeps the gear within "
        f"{low:g} … {high:g} mm with probability {_share(spring.probability)}.",
    )


def generator_words(found: GeneratorAnswer) -> Iterator[str]:
    """Yield what the wave generator has to be."""
    asked, spring, aim = found.asked, found.spring, found.set_point
    low, high = asked.window_mm
    force, pull = aim.force_N, "press" if asked.sense > 0 else "pull"
    size = interval_along(force.median, force.lo, force.hi, asked.sense)
    middle, span = estimate(size)
    yield (
        f"To hold the gear at {aim.deformation_mm:.4g} mm each side has to {pull} "
        f"with {middle} N ({percent(found.interval)} {_kind(found)} {span} N) at "
        f"{aim.temperature_C:g} °C."
    )
    softest = "any spring does, down to the softest that was considered: "
    if not spring.softest_considered:
        softest = "the softest spring that does it has "
    yield (
        f"With one set point for every gear, {softest}"
        f"{number(spring.rate_N_per_mm)} N/mm, {number(spring.rate_over_gear)} "
        f"times the gear's own stiffness. Its free end stands {_free_end(found)}."
    )
    yield (
        f"It keeps {low:g} … {high:g} mm at {_warmth(asked.temperature_C)} with "
        f"probability {_chance(spring)} (required {asked.probability:g}): no "
        f"backlash {_share(spring.zero_backlash)}, no jam {_share(spring.no_jam)}."
    )
    yield _adjusting(found)
    yield _stress(found.stress, f"At {found.stress.deformation_mm:g} mm")


def _free_end(found: GeneratorAnswer) -> str:
    """Return where the free end of the spring is to stand."""
    side = "beyond" if found.asked.sense > 0 else "inside"
    far = found.asked.sense * found.spring.interference_mm
    return f"{number(far)} mm {side} the undeformed gear"


def _adjusting(found: GeneratorAnswer) -> str:
    own = found.adjusted
    (x, y), (force, more) = (
        ends_along(*ends, found.asked.sense)
        for ends in (own.interference_mm, own.preload_N)
    )
    share = percent(own.share_of_gears)
    return (
        f"Adjusted gear by gear with that spring, the set point has to reach from "
        f"{number(x, y - x)} to {number(y, y - x)} mm, that is a preload of "
        f"{number(force, more - force)} to {number(more, more - force)} N, to serve "
        f"{share} of the gears; the window is then kept with probability "
        f"{_share(own.probability)}."
    )


def inverse_headline(found: InverseAnswer) -> str:
    """Return which sizes keep the limit, in one sentence."""
    return as_known(found, _kept(found))


def inverse_words(found: InverseAnswer) -> Iterator[str]:
    """Yield which sizes keep the limit."""
    yield f"{_kept(found)} {nearness(found)}"
    yield from inverse_details(found)


def _kept(found: InverseAnswer) -> str:
    asked, best = found.asked, found.design
    sizes = ", ".join(
        f"{name.replace('_', ' ')} {value:.4g} mm"
        for name, value in best.sizes_mm.items()
    )
    what = " with ".join(filter(None, (best.material, sizes)))
    return (
        f"{what} needs at most {asked.limit_force_N:g} N at "
        f"{asked.deformation_mm:g} mm and {_warmth(asked.temperature_C)} with "
        f"probability {_chance(best)} (required {asked.probability:g})."
    )


def nearness(found: InverseAnswer) -> str:
    """Return what the sizes were chosen by."""
    if found.as_tested:
        return f"These are the sizes of {_own(found)}."
    return (
        "Of all that keep the limits its sizes are the nearest to those of "
        f"{_own(found)}."
    )


def inverse_details(found: InverseAnswer) -> Iterator[str]:
    """Yield force, stress and slopes of the chosen design."""
    asked, best, tested = found.asked, found.design, found.tested
    middle, span = estimate(best.force_N)
    most = number(best.force_N.kept, best.force_N.hi - best.force_N.lo)
    words = (
        f"Its force is {middle} N ({percent(found.interval)} {_kind(found)} {span} "
        f"N); with probability {asked.probability:g} it does not go beyond {most} N."
    )
    if not found.as_tested:
        words += (
            f" {_own(found).capitalize()} needs {estimate(tested.force_N)[0]} N and "
            f"keeps the limit with probability {_share(tested.probability)}."
        )
    yield words
    yield _stress(best, f"At {asked.deformation_mm:g} mm")
    if asked.limit_stress_MPa is not None:
        yield f"The stress was kept below {asked.limit_stress_MPa:g} MPa."
    elif best.yield_MPa is None:
        yield (
            "The material's file names no yield strength: the stress was not limited. "
            "Give a limit of the stress."
        )
    parts = [
        f"{name.removesuffix('_mm').replace('_', ' ')} {value:+.2f} %"
        for name, value in found.elasticities.items()
        if abs(value) > 1e-9
    ]
    yield f"One per cent more of each changes this force by: {', '.join(parts)}."


def _stress(entry: StressAnswer, where: str) -> str:
    middle, span = estimate(entry.stress_MPa)
    text = (
        f"{where} the smooth wall bends with {middle} MPa under the load ({span} MPa)"
    )
    if entry.utilisation is not None:
        text += f", {percent(entry.utilisation.median)} of its yield strength"
    return (
        f"{text}. This is from the imposed shape; notches at the teeth are not in it."
    )


def _own(found: DesignAnswer) -> str:
    return "the tested gear" if found.basis == "posterior" else "the gear of the file"


def _kind(found: DesignAnswer) -> str:
    return found.interval_kind.removeprefix("equal-tailed ")


def _warmth(levels: Sequence[float]) -> str:
    low, high = min(levels), max(levels)
    return f"{low:g} °C" if low == high else f"{low:g} … {high:g} °C"


def _chance(entry: ChosenSpring | CandidateAnswer) -> str:
    told = _share(entry.probability)
    bounded = told.startswith(("above", "below"))
    return told if bounded else f"{told} ± {entry.standard_error:.2g}"


def _share(value: float) -> str:
    """Return a probability; what was always so among the draws is not certain."""
    if value > 0.9995:
        return "above 0.999"
    return "below 0.001" if value < 0.0005 else f"{value:.4g}"


def beyond_tested(
    basis: DesignDraws, deformation: np.ndarray, temperature: np.ndarray
) -> list[str]:
    """Say which deformations and temperatures no reading covers, in words."""
    if basis.records is None:
        return []
    ratio, told = basis.problem.reading.radial_per_read, []
    radial = np.asarray(basis.records.deformation * ratio)
    if words := _outside("deformation", deformation, radial, NEAR_MM, "mm"):
        told.append(words + _bend(basis, deformation, radial))
    warm = basis.records.temperature
    if words := _outside("temperature", temperature, warm, NEAR_K, "°C"):
        told.append(
            f"{words} Young's modulus carries it, linearly; a product has no rig that "
            "would drift."
        )
    return told


def _outside(name: str, values, measured, slack: float, unit: str) -> str:
    low, high = float(np.min(measured)), float(np.max(measured))
    if np.min(values) >= low - slack and np.max(values) <= high + slack:
        return ""
    asked = " … ".join(f"{v:g}" for v in sorted({values.min(), values.max()}))
    seen = f"{low:g}" if low == high else f"{low:g} … {high:g}"
    return f"Extrapolated: {name} {asked} {unit}, tested were {seen} {unit}."


def _bend(basis: DesignDraws, deformation: np.ndarray, measured: np.ndarray) -> str:
    """Say what may grow beyond the tested deformation, and how far that carries."""
    if basis.within_tested(deformation).all():
        return " Between there and the free shape the model goes on holding."
    low, high = float(np.min(measured)), float(np.max(measured))
    beyond = np.maximum(low - deformation, deformation - high)
    at = float(deformation[np.argmax(beyond)])
    words = (
        " A bend that these rows need not show may bring "
        f"{basis.bend_sd(at):.2g} N (sd) at {at:g} mm; the intervals hold it."
    )
    return words + _FAR_OUT * bool(beyond.max() > FAR * (high - low))


def far_from_tested(basis: DesignDraws, sizes: Mapping[str, np.ndarray]) -> list[str]:
    """Say which sizes lie more than a fifth off the tested gear's, in words."""
    told = []
    for name, values in sizes.items():
        own = float(getattr(basis.gear.geometry, SIZES[name]))
        worst = float(values[np.argmax(np.abs(np.log(values / own)))])
        if abs(np.log(worst / own)) > np.log(1.2):
            told.append(
                f"{name} = {worst:g} is far from the gear's {own:g}: no data support "
                "K there."
            )
    return told
