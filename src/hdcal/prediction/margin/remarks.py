"""What a margin rests on, in sentences: what is extrapolated, assumed or left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.inference.residuals import misfits
from hdcal.prediction.engine.causes import Cause
from hdcal.prediction.engine.conditions import temperature_is_tested
from hdcal.prediction.engine.population_force import PopulationForce, leftover_sd
from hdcal.prediction.margin.request import Criteria
from hdcal.prediction.margin.result import Exceedance

CALIBRATION_NOTE = (
    "“Calibration” is stiffness, zeros, effects and leftover together: the data tie "
    "them to each other, so that they have no shares of their own; of K and E0 only "
    "the product matters. The loss of modulus per kelvin stands alone only where it "
    "is the prior's."
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
    first = _main(forces)
    return (
        *_beyond_deformation(first),
        *_other_direction(first),
        *_beyond_temperature(first.cause, temperature),
    )


def _main(forces: Sequence[PopulationForce]) -> PopulationForce:
    return max(forces, key=lambda force: force.cause.probability)


def _beyond_deformation(force: PopulationForce) -> Iterator[str]:
    where = force.conditions
    at, low, high = where.deformation, where.low, where.high
    beyond = max(low - at, at - high)
    if beyond > 1e-9:
        fitted = force.cause.problem.gap is not None
        source = "the fitted leftover discrepancy" if fitted else "the prior only"
        sd = np.asarray(leftover_sd(force.cause.values, where))
        yield (
            f"Extrapolated: {at:g} mm lies {beyond:.3g} mm outside the tested "
            f"{low:g} … {high:g} mm. Widened by a leftover discrepancy of "
            f"{np.sqrt(np.mean(sd**2)):.2g} N (sd), from {source}."
        )


def _other_direction(force: PopulationForce) -> Iterator[str]:
    records, down = force.cause.posterior.case.records, force.conditions.down
    if (-1.0 if down else 1.0) not in np.asarray(records.sense):
        word = "unloading" if down else "loading"
        yield f"Extrapolated: {word} was not tested; nothing widens the bounds for it."


def _beyond_temperature(cause: Cause, temperature: np.ndarray) -> Iterator[str]:
    records = cause.posterior.case.records
    if not temperature_is_tested(records, temperature).all():
        by_data = cause.driver("alpha") == "data"
        source = (
            "the data" if by_data else "its prior (the material), not from the data"
        )
        cold, warm = np.min(records.temperature), np.max(records.temperature)
        asked = f"{np.min(temperature):g} … {np.max(temperature):g} °C"
        tested = f"{cold:g}" if cold == warm else f"{cold:g} … {warm:g}"
        if "temperature" not in records.known:
            tested += " °C (assumed, it was not measured)"
        else:
            tested += " °C"
        yield (
            f"Extrapolated: {asked} lies outside the tested {tested}. Young's modulus "
            f"carries it, linearly; its loss per kelvin is from {source}."
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
    said = [*_of_population(first), *_of_tolerances(first)]
    if all(force.cause.problem.gap is None for force in forces):
        said += misfits(first.cause.posterior)
    used = sum(force.cause.size for force in forces)
    rare = risk is not None and risk.probability < 1.0 / used
    if rare or max(criteria.content, criteria.required) > _TAIL:
        said.append(
            "Such rare cases rest on the normal tails of noise and scatter, which no "
            "test of this size has seen."
        )
    total = sum(len(force.cause.posterior.draws["K"]) for force in forces)
    if used < total:
        said.append(f"{used} of {total} draws were used.")
    return tuple(dict.fromkeys(said))


def _of_population(force: PopulationForce) -> Iterator[str]:
    whose, problem = force.whose, force.cause.problem
    if whose.quantity == "load":
        yield (
            "The load on the gear: without the gauge's zero, its errors and its noise. "
            "A leftover discrepancy counts as the gear's."
        )
        if whose.population == "mountings":
            yield (
                "Mountings differ by the gauge's zero, which is no load: here they "
                "are alike."
            )
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


def _of_tolerances(force: PopulationForce) -> Iterator[str]:
    if force.conditions.strata.factor.size == 1:
        return
    if force.whose.population == "specimens":
        yield (
            "The tolerances come on top of how much the tested gears differ, which "
            "already holds their own."
        )
    else:
        yield (
            "With tolerances the forces are those of gears that differ from the tested "
            "ones in these sizes and in nothing else."
        )
