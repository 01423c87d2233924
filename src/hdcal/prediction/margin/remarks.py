"""What a margin rests on in sentences: whose, extrapolated, assumed or left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.inference.checks import listed
from hdcal.inference.problem import Problem
from hdcal.inference.residuals import misfits
from hdcal.prediction.engine.causes import left_out_words
from hdcal.prediction.engine.conditions import (
    Conditions,
    beyond_tested,
    temperature_is_tested,
)
from hdcal.prediction.engine.loading_sense import LoadingSense
from hdcal.prediction.engine.population import Population
from hdcal.prediction.engine.population_force import PopulationForce, bend_law
from hdcal.prediction.engine.reading_grid import ReadingGrid
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import FAR, Level

_LOAD = (
    "The load on the gear: without the gauge's zero, its errors and its noise. "
    "A leftover discrepancy counts as the gear's."
)
_GAUGES = {
    "force_gain": "the {load} gauge",
    "deformation_gain": "the displacement gauge",
    "temperature_offset": "the thermometer",
}
_CERTIFIED = (
    "The load is that at a true {{displacement}} and temperature: the certificates of "
    "{which} widen it, and not a reading."
)
_NOT_CERTIFIED = (
    "The gear file states no calibration certificate with a gain of a gauge: gains "
    "count as exact in a load."
)
_ZERO = (
    "What the gauge shows without a load rests on its prior, not on these data: it is "
    "known to {sd:.2g} {{N}} (sd) and makes a load uncertain over some {both:.2g} "
    "{{N}}. Read the gauge with the gear out of contact, and state that zero as the "
    "prior of the {{load}} offset."
)
_LOAD_OF_MOUNTINGS = (
    "Mountings differ by the gauge's zero, which is no load: here they are alike."
)
_TOLERANCES_OF_GEARS = (
    "The tolerances come on top of how much the tested gears differ, which already "
    "holds their own."
)
_TOLERANCES_ALONE = (
    "With tolerances the {load}s are those of gears that differ from the tested ones "
    "in these sizes and in nothing else."
)
_EITHER_SIGN = (
    "The {{load}} may have either sign here: 95 % of members lie between {low:.3g} and "
    "{high:.3g} {{N}}. Capacities and probabilities count the {sign} ones only."
)
_AGAINST = (
    "The gauge's zero turns the sign of the {{load}} here, {low:.3g} … {high:.3g} "
    "{{N}}: no capacity can be compared with it. The load has the sign of the loading."
)
_NORMAL_TAILS = (
    "Such rare cases rest on the normal tails of noise and scatter, which no test of "
    "this size has seen."
)
_GRID = (
    "Readings come in steps of {step:.3g} {{N}}: bounds and capacities are values that "
    "are read, and the {{load}} itself may lie up to {half:.3g} {{N}} beyond them. U "
    "takes the steps for an error that is anywhere in half a step."
)
_NO_GRID = (
    "Readings have steps of {step:.3g} {{N}} but lie on no one grid of such steps: "
    "bounds, capacities and what exceeds them are for the worst place of a grid, "
    "{half:.3g} {{N}} away."
)
_FAR_OUT = (
    " So far out a bound rests on that assumption, and its confidence with it: test "
    "there before you rely on it."
)
# A content beyond this only the normal law tells.
_TAIL = 0.9999


def extrapolations(
    forces: Sequence[PopulationForce], temperature: np.ndarray
) -> tuple[str, ...]:
    """Return sentences on what lies outside the data.

    Args:
        forces: of each cause; the likeliest speaks.
        temperature: all that were asked for [°C].
    """
    return tuple(_extrapolations(_main(forces), temperature))


def _main(forces: Sequence[PopulationForce]) -> PopulationForce:
    return max(forces, key=lambda force: force.cause.probability)


def _extrapolations(force: PopulationForce, temperature: np.ndarray) -> Iterator[str]:
    cause, where = force.cause, force.conditions
    records = cause.posterior.case.records
    at, low, high = (float(x) for x in (where.deformation, where.low, where.high))
    beyond = beyond_tested(where)
    if beyond > 0.0:
        far = _FAR_OUT * (beyond > FAR)
        yield (
            f"Extrapolated: {at:g} {{mm}} lies {max(low - at, at - high):.3g} {{mm}} "
            f"outside the tested {low:g} … {high:g} {{mm}}. {_bend(force)}{far}"
        )
    if float(where.movement) not in np.asarray(records.sense):
        word = "unloading" if where.down else "loading"
        if not low < at < high and (at < 0.0) != (low + high < 0.0):
            word += " in tension" if at < 0.0 else " in compression"
        yield f"Extrapolated: {word} was not tested; nothing widens the bounds for it."
    if not temperature_is_tested(records, temperature).all():
        yield _untested_temperature(force, temperature)


def _bend(force: PopulationForce) -> str:
    """Say what a bend may bring where nothing was tested, and what one that is seen."""
    mean, sd = bend_law(force)
    if abs(mean) < sd:
        return (
            f"A bend that these rows need not show may bring {sd:.2g} {{N}} (sd) there."
        )
    return (
        f"The bend that these rows leave over goes on there: {mean:+.2g} {{N}} of the "
        f"mean are its, and it may bring {sd:.2g} {{N}} (sd) more or less."
    )


def _untested_temperature(force: PopulationForce, temperature: np.ndarray) -> str:
    cause = force.cause
    records = cause.posterior.case.records
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    seen = f"{cold:g} °C" if cold == warm else f"{cold:g} … {warm:g} °C"
    known = "temperature" in records.known
    assumed = "" if known else " (assumed, it was not measured)"
    by_data = cause.driver("alpha") == "data"
    source = "the data" if by_data else "its prior (the material), not from the data"
    low, high = np.min(temperature), np.max(temperature)
    asked = f"{low:g} °C" if low == high else f"{low:g} … {high:g} °C"
    return (
        f"Extrapolated: {asked} lies outside the tested {seen}{assumed}. Young's "
        "modulus carries it, linearly; "
        f"its loss per kelvin is from {source}." + _rig_drift(force)
    )


def _rig_drift(force: PopulationForce) -> str:
    """Say what the rig may do at untested temperatures."""
    untested, stiff = force.conditions.untested, force.cause.values["stiffness"]
    (_, zero), (_, frame) = untested.zero, untested.frame
    radial = force.cause.problem.reading.radial_per_read
    moves = frame * float(np.median(stiff)) / radial
    drifts = (zero, "zero of its gauge"), (moves, "length of its frame")
    parts = [
        f"{sd:.2g} {{N}} per kelvin by the {cause}" for sd, cause in drifts if sd > 0.0
    ]
    if force.whose.quantity == "load" or not parts:
        return ""
    return (
        f" The rig may drift too, by its priors (sd) {' and '.join(parts)}; the load "
        "on the gear has no part in that."
    )


def remarks(
    forces: Sequence[PopulationForce],
    levels: Sequence[Level],
    worst: Level,
    criteria: Criteria,
    grid: ReadingGrid,
) -> tuple[str, ...]:
    """Return sentences on what the numbers rest on.

    Args:
        forces: of each cause; the likeliest speaks.
        levels: the force at each temperature.
        worst: of all of them.
        criteria: what was to be kept.
        grid: of the readings.
    """
    first = _main(forces)
    said = left_out_words([force.cause for force in forces])
    said += [*_signs(levels, first.sense), *_of_population(first)]
    said += [*_of_turning(first.conditions), *_of_steps(grid)]
    # Where causes are averaged, what no model explains is one of them.
    alone = len(forces) == 1
    straight = all(force.cause.problem.discrepancy is None for force in forces)
    said += misfits(first.cause.posterior, shapes=alone or straight)
    used = sum(force.cause.size for force in forces)
    risk = worst.exceedance
    rare = risk is not None and risk.probability < 1.0 / used
    if rare or max(criteria.content, criteria.required) > _TAIL:
        said.append(_NORMAL_TAILS)
    total = sum(len(force.cause.posterior.draws["K"]) for force in forces)
    if used < total:
        said.append(f"{used} of {total} draws were used.")
    return tuple(dict.fromkeys(said))


def _of_turning(asked: Conditions) -> Iterator[str]:
    """Say where unloading begins."""
    if not asked.down:
        return
    turn, at = float(asked.turn), float(asked.deformation)
    why = "the largest tested" if turn != at else "as far as what is asked for"
    yield f"Unloading is taken to begin at {turn:g} {{mm}}, {why}."


def _of_steps(grid: ReadingGrid) -> Iterator[str]:
    """Say what the steps of the readings do to bounds and capacities."""
    if grid.step == 0.0:
        return
    if grid.origin is None:
        yield _NO_GRID.format(step=grid.step, half=0.5 * grid.step)
    else:
        yield _GRID.format(step=grid.step, half=0.5 * grid.step)


def _signs(levels: Sequence[Level], sense: LoadingSense) -> Iterator[str]:
    spans = [level.member_N for level in levels]
    low, high = min(span.lo for span in spans), max(span.hi for span in spans)
    if max(sense * low, sense * high) < 0.0:
        yield _AGAINST.format(low=low, high=high)
    elif low < 0.0 < high:
        sign = "positive" if sense > 0 else "negative"
        yield _EITHER_SIGN.format(low=low, high=high, sign=sign)


def _of_population(force: PopulationForce) -> Iterator[str]:
    whose, problem = force.whose, force.cause.problem
    if whose.quantity == "load":
        yield _LOAD
        known = force.cause.posterior.case.gear.gauge_priors
        which = [_GAUGES[name] for name in known]
        yield _CERTIFIED.format(which=listed(which)) if which else _NOT_CERTIFIED
        yield from _zero_by_prior(force)
        if whose.population == "mountings":
            yield _LOAD_OF_MOUNTINGS
    for name, what, count in (
        ("specimen_sd", "gears", whose.tested_gears(problem)),
        ("run_offset_sd", "mountings", whose.tested_mountings(problem)),
    ):
        found = force.cause.posterior.diagnoses.get(name)
        if count and found is not None and found.driven_by == "prior":
            yield (
                f"How much {what} differ rests on the prior: {count} were too few to "
                "tell."
            )
    if force.tolerances:
        gears = whose.population == "specimens"
        yield _TOLERANCES_OF_GEARS if gears else _TOLERANCES_ALONE


def _zero_by_prior(force: PopulationForce) -> Iterator[str]:
    """Say how much of the load's width the prior of the gauge's zero makes."""
    cause = force.cause
    if cause.driver("force_offset") == "prior":
        sd = float(np.std(cause.values["force_offset"]))
        yield _ZERO.format(sd=sd, both=4.0 * sd)


def population_words(population: Population, problem: Problem) -> str:
    """Return in one sentence whose forces the numbers are about."""
    if population == "readings":
        gears = "the tested gears on average" if problem.specimens else "this one gear"
        place = "mountings on average" if problem.runs else "mounting"
        return (
            f"Single readings of {gears} in the tested {place}. Another gear or "
            "another mounting may need a {load} outside these bounds."
        )
    runs = f", each in a new mounting ({problem.runs} were tested)"
    if population == "mountings":
        gears = "the tested gears on average" if problem.specimens else "this one gear"
        return (
            f"New mountings of {gears} ({problem.runs} were tested), a reading each. "
            "Another gear may need a {load} outside these bounds."
        )
    place = runs if problem.runs else ", in the tested mounting"
    return f"New gears of this kind ({problem.specimens} were tested){place}."
