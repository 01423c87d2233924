"""What a margin rests on: what is extrapolated, assumed or left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import misfits
from hdcal.prediction.margin import document as say
from hdcal.prediction.population_force import Outlook

# As of the bands: thermometers are no better [K].
_NEAR_K = 1.0


def is_tested(posterior: Posterior, deformation: float, temperature, down: bool):
    """Tell whether the data hold this deformation, direction and temperature."""
    records = posterior.case.records
    low, high = records.deformation.min(), records.deformation.max()
    sense = -1.0 if down else 1.0
    return bool(
        low - 1e-9 <= deformation <= high + 1e-9
        and sense in np.asarray(records.sense)
        and not _outside(records.temperature, temperature)
    )


def _outside(measured, temperature) -> bool:
    cold, warm = np.min(temperature), np.max(temperature)
    low, high = np.min(measured) - _NEAR_K, np.max(measured) + _NEAR_K
    return bool(cold < low or warm > high)


def extrapolations(outlook: Outlook, temperature: np.ndarray) -> tuple[str, ...]:
    """Return sentences on what lies outside the data.

    Args:
        outlook: of the likeliest model.
        temperature: all that were asked for [°C].
    """
    return tuple(_extrapolations(outlook, temperature))


def _extrapolations(outlook: Outlook, temperature) -> Iterator[str]:
    question, records = outlook.question, outlook.posterior.case.records
    at, low, high = question.deformation, question.low, question.high
    beyond = max(low - at, at - high)
    if beyond > 1e-9:
        length = outlook.values["gap_length"] * (high - low)
        sd = outlook.values["gap_sd"] * np.sqrt(-np.expm1(-((beyond / length) ** 2)))
        yield say.untested_deformation(
            float(at),
            (low, high),
            leftover=float(np.sqrt(np.mean(sd**2))),
            fitted=outlook.posterior.problem.discrepancy is not None,
        )
    sense = -1.0 if question.down else 1.0
    if sense not in np.asarray(records.sense):
        yield say.untested_direction(down=question.down)
    if _outside(records.temperature, temperature):
        found = outlook.posterior.diagnoses.get("alpha")
        yield say.untested_temperature(
            (np.min(temperature), np.max(temperature)),
            (np.min(records.temperature), np.max(records.temperature)),
            measured="temperature" in records.known,
            by_data=found is not None and found.driven_by == "data",
        )


def remarks(
    outlooks: Sequence[tuple[float, Outlook]], rare: float | None, rounded_tail: bool
) -> tuple[str, ...]:
    """Return sentences on what the numbers rest on.

    Args:
        outlooks: of each model, with its probability.
        rare: smallest probability that is stated, or None.
        rounded_tail: whether a content is asked for that only the normal law tells.
    """
    return tuple(dict.fromkeys(_remarks(outlooks, rare, rounded_tail)))


def _remarks(outlooks, rare, rounded_tail) -> Iterator[str]:
    first = outlooks[0][1]
    posterior, problem = first.posterior, first.posterior.problem
    draws = sum(len(outlook.values["K"]) for _, outlook in outlooks)
    if first.quantity == "load":
        yield say.LOAD
        if first.population == "mountings":
            yield say.LOAD_OF_MOUNTINGS
    own_zero = first.population != "readings" and first.quantity == "reading"
    for name, what, count in (
        ("specimen_sd", "gears", problem.specimens * (first.population == "specimens")),
        ("run_offset_sd", "mountings", problem.runs * own_zero),
    ):
        found = posterior.diagnoses.get(name)
        if count and found is not None and found.driven_by == "prior":
            yield say.few_tested(what, count)
    if first.nodes.factor.size > 1:
        gears = first.population == "specimens"
        yield say.TOLERANCES_OF_GEARS if gears else say.TOLERANCES_ALONE
    if all(outlook.posterior.problem.discrepancy is None for _, outlook in outlooks):
        yield from misfits(posterior)
    if (rare is not None and rare < 1.0 / draws) or rounded_tail:
        yield say.NORMAL_TAILS
    total = sum(len(outlook.posterior.draws["K"]) for _, outlook in outlooks)
    if draws < total:
        yield say.draws_used(draws, total)
