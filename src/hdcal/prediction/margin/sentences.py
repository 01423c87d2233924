"""A margin in sentences that need no statistics to be understood."""

from collections.abc import Iterator

from hdcal.inference.residuals import SHAPED, UNNAMED
from hdcal.prediction.margin.number_words import (
    NEARLY_ALL,
    RAREST,
    chance,
    index,
    newtons,
)
from hdcal.prediction.margin.result import (
    FAR,
    Exceedance,
    Level,
    Margin,
    ModelBound,
    sizes_needed,
)
from hdcal.report.words import hypothesis, number

_MEMBER = {"readings": "reading", "mountings": "mounting", "specimens": "gear"}
_MANY = {"readings": "readings", "mountings": "mountings", "specimens": "gears"}
_INPUTS = {
    "calibration": "calibration (stiffness, zeros)",
    "cause": "which effect is at work",
    "alpha": "loss of modulus per kelvin α",
    "noise": "reading noise",
    "mounting": "mounting to mounting",
    "gear": "gear to gear",
    "leftover": "leftover beyond the tested range",
    "zero_drift": "zero of the gauge with temperature",
    "frame": "frame with temperature",
    "wall_thickness": "wall thickness δ",
    "radius": "radius R",
    "length": "length L",
    "load_height": "load height",
    "E0_GPa": "Young's modulus E₀",
    "K": "influence coefficient K",
}


def member_word(found: Margin) -> str:
    """Return what one member of the population is called."""
    return _MEMBER[found.population]


def measurand(found: Margin) -> str:
    """Return what the stated estimate and uncertainty are of."""
    if found.quantity == "reading":
        return f"one future {member_word(found)}"
    gears = found.population == "specimens"
    return "the load on one future gear" if gears else "the load on the gear"


def input_label(name: str) -> str:
    """Return what an input of a gradient or share is called."""
    return _INPUTS.get(name.removesuffix("_mm"), name)


def bound_name(found: Margin) -> str:
    """Return content and confidence as people write them: 99/95."""
    return f"{100.0 * found.content:.6g}/{100.0 * found.confidence:.6g}"


def in_tension(found: Margin) -> str:
    """Return what is added to the size of a force on a gear that is pulled."""
    return "" if found.loading_sense > 0 else " in tension"


def larger_bound(found: Margin) -> str:
    """Return which of the bounds with their sign is the larger one in size."""
    return "upper" if found.loading_sense > 0 else "lower"


def headline(found: Margin) -> str:
    """Return whether the capacity is enough, or which force is needed."""
    say = found.units.say
    if found.limit_force_N is not None:
        return say(_enough(found, found.limit_force_N))
    return say(
        f"At {found.deformation_mm:g} {{mm}} {_percent(found.content)} of "
        f"{_many(found)} need at most {_at_most(found, found.worst)}, with "
        f"{_percent(found.confidence)} confidence{_if_bent_so(found)}."
    )


def next_steps(found: Margin) -> Iterator[str]:
    """Yield what to do about what the model lacks, a small capacity, or no test."""
    yield from map(found.units.say, _steps(found))


def _steps(found: Margin) -> Iterator[str]:
    level, limit = found.worst, found.limit_force_N
    shaped = [words for words in found.remarks if words.startswith(SHAPED)]
    if any(UNNAMED in words for words in shaped):
        yield (
            "Calibrate with a gap before you rely on this: the residuals have a shape "
            "that no cause named makes, and these bounds leave it out."
        )
    elif shaped:
        yield (
            "Diagnose before you rely on this, or calibrate with a gap: the residuals "
            "have a shape that these bounds leave out."
        )
    if limit is not None and limit < level.capacity_N:
        yield (
            f"Provide {newtons(level.capacity_N)}{in_tension(found)}: that is enough "
            f"with {_percent(found.confidence)} confidence{_if_bent_so(found)}."
        )
    if found.extrapolated:
        yield (
            f"Measure at {found.deformation_mm:g} {{mm}} {_where(found)} too: what was "
            "not tested is extrapolated."
        )


def answer(found: Margin) -> list[str]:
    """Return the answer in sentences."""
    told = [*_inverse(found), *_force(found), *_capacity(found), *_models(found)]
    return [*map(found.units.say, told)]


def _if_bent_so(found: Margin) -> str:
    """Return on what a confidence far beyond the tested deformation rests."""
    far = ", if nothing but the assumed bend comes in beyond what was tested"
    return far * (found.beyond_tested > FAR)


def _percent(share: float) -> str:
    return f"{100.0 * share:.6g} %"


def _many(found: Margin) -> str:
    return _MANY[found.population]


def _where(found: Margin) -> str:
    warm = [level.temperature_C for level in found.levels]
    if len(warm) == 1:
        return f"at {warm[0]:g} °C"
    return f"over {min(warm):g} … {max(warm):g} °C"


def _at_most(found: Margin, of: Level | ModelBound) -> str:
    """Return the size of the force that most do not need more than."""
    return newtons(sizes_needed(of, found.loading_sense)[1]) + in_tension(found)


def _force(found: Margin) -> Iterator[str]:
    level, share = found.worst, _percent(found.content)
    what = "{load} that the gauge shows" if found.quantity == "reading" else "load"
    way = "" if found.direction == "up" else ", unloading,"
    several = len(found.levels) > 1
    at = f" at its worst, {level.temperature_C:g} °C," if several else ""
    sure = _percent(found.confidence)
    width = level.force_N.hi - level.force_N.lo
    low, middle, high = (
        number(end, width)
        for end in (level.force_N.lo, level.force_N.median, level.force_N.hi)
    )
    yield (
        f"At {found.deformation_mm:g} {{mm}}{way} the mean {what}{at} is {middle} "
        f"{{N}}, 95 % credible interval {low} … {high} {{N}}."
    )
    basis = f", an {found.basis} value" if found.basis[:1] == "A" else ""
    basis = f", a {found.basis} value" if found.basis[:1] == "B" else basis
    yield (
        f"With {sure} confidence {share} of {_many(found)} need at most "
        f"{_at_most(found, level)} {_where(found)}{basis}. Taken by itself, the "
        f"bound from below is as sure: {share} need at least "
        f"{newtons(sizes_needed(level, found.loading_sense)[0])}."
    )
    yield f"Whose {{load}}s these are: {_lower(found.population_words)}"


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]


def _capacity(found: Margin) -> Iterator[str]:
    level, sure = found.worst, _percent(found.confidence)
    if level.exceedance is not None:
        assert found.limit_force_N is not None
        yield _enough(found, found.limit_force_N)
        yield from _exceedance(found, level.exceedance)
    likely, does = newtons(level.capacity_median_N), newtons(level.capacity_N)
    also = f"{likely} is as likely as not to do; {does} does with {sure} confidence."
    if likely == does:
        also = f"{does} does with {sure} confidence; less is more likely not to do."
    yield (
        f"To hold {100.0 * found.required_probability:.8g} % of "
        f"{_many(found)}{in_tension(found)}, a capacity of {also}"
    )


def _enough(found: Margin, limit: float) -> str:
    """Say first whether the capacity does."""
    level = found.worst
    share = f"{100.0 * found.required_probability:.8g} % of {_many(found)}"
    sure = _percent(found.confidence)
    given = f"A capacity of {limit:g} {{N}}{in_tension(found)}"
    if limit >= level.capacity_N:
        return (
            f"{given} is enough for {share}, with {sure} confidence"
            f"{_if_bent_so(found)}."
        )
    if limit >= level.capacity_median_N:
        return (
            f"{given} is more likely than not enough for {share}, but not with {sure} "
            "confidence."
        )
    return f"{given} is NOT enough for {share}."


def _exceedance(found: Margin, risk: Exceedance) -> Iterator[str]:
    more = f"more than {found.limit_force_N:g} {{N}}{in_tension(found)}"
    one = f"One future {member_word(found)} needs {more}"
    sure = _percent(found.confidence)
    if max(risk.hi, risk.probability) < RAREST:
        rarest = chance(risk.probability)
        yield f"{one} with a probability of {rarest}: β is {index(risk.beta)}."
        if risk.rests_on and risk.probability >= RAREST:
            yield risk.rests_on
        return
    low, high = chance(risk.lo), chance(risk.hi)
    span = f"is {high}" if low == high else f"lies between {low} and {high}"
    if risk.lo < RAREST <= risk.hi:
        span = f"is at most {high}"
        if risk.hi > NEARLY_ALL:
            span = "may be none of them or nearly all"
    most = chance(risk.at_confidence)
    most = most if risk.at_confidence < RAREST else f"below {most}"
    yield (
        f"{one} with a probability of {chance(risk.probability)}: reliability index "
        f"β = {index(risk.beta)}. The share of {_many(found)} that do {span} "
        "(95 % credible interval, 2.5 % beyond either end); "
        + (
            f"taken from one side, with {sure} confidence it is {most}, β "
            f"{index(risk.beta_at_confidence)}."
            if risk.at_confidence < NEARLY_ALL
            else f"at {sure} confidence it may be all of them."
        )
    )
    if risk.probability > min(risk.hi, risk.at_confidence):
        beyond = "the interval" if risk.probability > risk.hi else "that bound"
        yield (
            f"The probability lies above {beyond} of the share because what is least "
            "likely of the gear, of its zero or of its scatter makes most of it."
        )
    if risk.rests_on:
        yield risk.rests_on


def _inverse(found: Margin) -> Iterator[str]:
    got = found.reached
    if got is None:
        return
    low, high = got.searched_mm
    beyond = f"a {{displacement}} outside {low:g} … {high:.3g} {{mm}}"

    def at(value: float | None) -> str:
        return beyond if value is None else f"{value:.4g} {{mm}}"

    middle = (
        f"{got.force_N:g} {{N}} reach {at(got.median_mm)} at {got.temperature_C:g} °C"
    )
    span = ""
    if got.lo_mm is not None and got.hi_mm is not None:
        span = f" (95 % credible interval {got.lo_mm:.4g} … {got.hi_mm:.4g} {{mm}})"
    share = _percent(found.content)
    least, most = got.lower_bound_mm, got.upper_bound_mm
    if got.median_mm is least is most is None:
        within = f"No {{displacement}} within {low:g} … {high:.3g} {{mm}} needs"
        yield f"{within} {got.force_N:g} {{N}}."
        return
    if got.force_N < 0.0:
        least, most = most, least
    tested = "" if got.tested else " Part of this lies outside what was tested."
    yield (
        f"{middle} in the mean{span}. With {_percent(found.confidence)} confidence "
        f"{share} of {_many(found)} get at least to {at(least)}, and as surely {share} "
        f"get at most to {at(most)}.{tested}"
    )


def _models(found: Margin) -> Iterator[str]:
    if not found.models:
        return
    each = "; ".join(
        f"{hypothesis(model.model)} ({100.0 * model.probability:.0f} %): "
        f"{_at_most(found, model)}"
        for model in found.models
    )
    likeliest = max(found.models, key=lambda model: model.probability)
    bound, alone = (
        sizes_needed(of, found.loading_sense)[1] for of in (found.worst, likeliest)
    )
    yield (
        "The bounds average over the causes that are left, by their probability. Upper "
        f"bound with each alone: {each}. The average is "
        f"{newtons(bound)}, {bound - alone:+.2g} {{N}} from the likeliest alone."
    )
