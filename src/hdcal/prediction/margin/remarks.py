"""What a margin rests on: what is extrapolated, assumed or left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.inference.residuals import misfits
from hdcal.prediction.engine.conditions import NEAR_MM, temperature_is_tested
from hdcal.prediction.engine.population_force import PopulationForce, leftover_sd
from hdcal.prediction.margin import document as say
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import Exceedance

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
    at, low, high = where.deformation, where.low, where.high
    if max(low - at, at - high) > NEAR_MM:
        sd = np.asarray(leftover_sd(cause.values, where))
        yield say.untested_deformation(
            float(at),
            (float(low), float(high)),
            leftover=float(np.sqrt(np.mean(sd**2))),
            fitted=cause.problem.discrepancy is not None,
        )
    if (-1.0 if where.down else 1.0) not in np.asarray(records.sense):
        yield say.untested_direction(down=where.down)
    if not temperature_is_tested(records, temperature).all():
        yield say.untested_temperature(
            (np.min(temperature), np.max(temperature)),
            (np.min(records.temperature), np.max(records.temperature)),
            measured="temperature" in records.known,
            by_data=cause.driver("alpha") == "data",
        )


def remarks(
    forces: Sequence[PopulationForce], risk: Exceedance | None, criteria: Criteria
) -> tuple[str, ...]:
    """Return sentences on what the numbers rest on.

    Args:
        forces: of each cause; the likeliest speaks.
        risk: of the given capacity, or None.
        criteria: what was to be kept.
    """
    first = _main(forces)
    said = list(_of_population(first))
    if all(force.cause.problem.discrepancy is None for force in forces):
        said += misfits(first.cause.posterior)
    used = sum(force.cause.size for force in forces)
    rare = risk is not None and risk.probability < 1.0 / used
    if rare or max(criteria.content, criteria.required) > _TAIL:
        said.append(say.NORMAL_TAILS)
    total = sum(len(force.cause.posterior.draws["K"]) for force in forces)
    if used < total:
        said.append(say.draws_used(used, total))
    return tuple(dict.fromkeys(said))


def _of_population(force: PopulationForce) -> Iterator[str]:
    whose, problem = force.whose, force.cause.problem
    if whose.quantity == "load":
        yield say.LOAD
        if whose.population == "mountings":
            yield say.LOAD_OF_MOUNTINGS
    for name, what, count in (
        ("specimen_sd", "gears", whose.tested_gears(problem)),
        ("run_offset_sd", "mountings", whose.tested_mountings(problem)),
    ):
        found = force.cause.posterior.diagnoses.get(name)
        if count and found is not None and found.driven_by == "prior":
            yield say.few_tested(what, count)
    if force.tolerances:
        gears = whose.population == "specimens"
        yield say.TOLERANCES_OF_GEARS if gears else say.TOLERANCES_ALONE
