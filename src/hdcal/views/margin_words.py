"""A margin in sentences that need no statistics to be understood."""

from collections.abc import Iterator

from hdcal.answers.margins.answer import Exceedance, Level, Margin
from hdcal.views.verdict_words import hypothesis
from hdcal.views.wording import number

_MEMBER = {"readings": "reading", "mountings": "mounting", "specimens": "gear"}
_INPUTS = {
    "calibration": "calibration (stiffness, zeros)",
    "cause": "which effect is at work",
    "alpha": "loss of modulus per kelvin α",
    "noise": "reading noise",
    "mounting": "mounting to mounting",
    "gear": "gear to gear",
    "leftover": "leftover beyond the tested range",
    "wall_thickness": "wall thickness δ",
    "radius": "radius R",
    "length": "length L",
    "load_height": "load height",
    "E0_GPa": "Young's modulus E₀",
    "K": "influence coefficient K",
}
# Rarer than this nobody can say; the words then say so.
_RAREST = 1e-12


def member_word(found: Margin) -> str:
    """Return what one member of the population is called."""
    return _MEMBER[found.population]


def input_label(name: str) -> str:
    """Return what an input of a gradient or share is called."""
    return _INPUTS.get(name.removesuffix("_mm"), name)


def bound_name(found: Margin) -> str:
    """Return content and confidence as people write them: 99/95."""
    return f"{100.0 * found.content:.6g}/{100.0 * found.confidence:.6g}"


def chance(probability: float) -> str:
    """Return a probability; never one that nobody can know."""
    if probability < _RAREST:
        return f"less than {_RAREST:.0e}"
    if probability > 1.0 - _RAREST:
        return "certain"
    if probability > 0.99:
        return f"{100.0 * probability:.6g} %"
    if probability >= 0.001:
        return f"{100.0 * probability:.2g} %"
    return f"{probability:.1e}"


def index(beta: float) -> str:
    """Return a reliability index; beyond ± 7 no probability can be known."""
    if beta > 7.0:
        return "above 7"
    return "below −7" if beta < -7.0 else f"{beta:.2f}"


def answer(found: Margin) -> list[str]:
    """Return the answer in sentences."""
    return [*_force(found), *_capacity(found), *_inverse(found), *_models(found)]


def _where(found: Margin) -> str:
    warm = [level.temperature_C for level in found.levels]
    if len(warm) == 1:
        return f"at {warm[0]:g} °C"
    return f"over {min(warm):g} … {max(warm):g} °C"


def _newtons(value: float) -> str:
    return f"{value:.4g} N" if abs(value) < 1e4 else f"{value:.5g} N"


def _force(found: Margin) -> Iterator[str]:
    level, share = found.worst, f"{100.0 * found.content:.6g} %"
    what = "reading" if found.quantity == "reading" else "load"
    way = "" if found.direction == "up" else ", unloading"
    several = len(found.levels) > 1
    at = f" at its worst, {level.temperature_C:g} °C" if several else ""
    sure = f"{100.0 * found.confidence:.6g} %"
    width = level.force_N.hi - level.force_N.lo
    low, high = (number(end, width) for end in (level.force_N.lo, level.force_N.hi))
    yield (
        f"At {found.deformation_mm:g} mm{way} the mean force ({what}){at} is "
        f"{number(level.force_N.median, width)} N, 95 % credible interval "
        f"{low} … {high} N."
    )
    basis = f" ({found.basis})" if found.basis else ""
    yield (
        f"With {sure} confidence {share} of them need at most "
        f"{_newtons(level.upper_bound_N)}, {_where(found)}{basis}; by another bound, as "
        f"sure by itself, {share} need at least {_newtons(level.lower_bound_N)}."
    )
    yield f"“They” are: {found.population_words}"


def _capacity(found: Margin) -> Iterator[str]:
    level = found.worst
    if level.exceedance is not None:
        yield from _exceedance(found, level.exceedance)
    yield (
        f"To hold {100.0 * found.required_probability:.8g} % of them, "
        f"{_needed(found, level)}."
    )


def _needed(found: Margin, level: Level) -> str:
    sure = f"{100.0 * found.confidence:.6g} %"
    return (
        f"a capacity of {_newtons(level.capacity_predictive_N)} is expected to do, and "
        f"{_newtons(level.capacity_N)} does with {sure} confidence"
    )


def _exceedance(found: Margin, risk: Exceedance) -> Iterator[str]:
    one = f"One future {member_word(found)} needs more than {found.limit_force_N:g} N"
    sure = f"{100.0 * found.confidence:.6g} %"
    yield (
        f"{one} with probability {chance(risk.probability)} (reliability index β = "
        f"{index(risk.beta)}). The share of all that do lies between {chance(risk.lo)} "
        f"and {chance(risk.hi)} (95 %), and with {sure} confidence below "
        f"{chance(risk.at_confidence)} (β = {index(risk.beta_at_confidence)} or more)."
    )


def _inverse(found: Margin) -> Iterator[str]:
    got = found.reached
    if got is None:
        return
    low, high = got.searched_mm
    beyond = f"not within {low:g} … {high:.3g} mm"

    def at(value: float | None) -> str:
        return beyond if value is None else f"{value:.4g} mm"

    middle = f"{got.force_N:g} N reach {at(got.median_mm)} at {got.temperature_C:g} °C"
    span = ""
    if got.lo_mm is not None and got.hi_mm is not None:
        span = f" (95 % credible interval {got.lo_mm:.4g} … {got.hi_mm:.4g} mm)"
    share = f"{100.0 * found.content:.6g} %"
    tested = "" if got.tested else " Part of this lies outside what was tested."
    yield (
        f"The other way round: {middle} in the mean{span}; with "
        f"{100.0 * found.confidence:.6g} % confidence {share} of them get at least to "
        f"{at(got.lower_bound_mm)}, and {share} at most to {at(got.upper_bound_mm)}."
        f"{tested}"
    )


def _models(found: Margin) -> Iterator[str]:
    if not found.models:
        return
    each = "; ".join(
        f"{hypothesis(model.model)} ({100.0 * model.probability:.0f} %): "
        f"{_newtons(model.upper_bound_N)}"
        for model in found.models
    )
    likeliest = max(found.models, key=lambda model: model.probability)
    change = found.worst.upper_bound_N - likeliest.upper_bound_N
    yield (
        "The cause of the gap is not settled, so the bounds average over the causes by "
        f"probability. Upper bound with each alone: {each}. The average is "
        f"{found.worst.upper_bound_N:.4g} N, {change:+.2g} N from the likeliest alone."
    )
