"""What a margin rests on, in sentences: what is extrapolated, assumed or left out."""

from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import misfits
from hdcal.prediction.population_force import Outlook

CALIBRATION_NOTE = (
    "“Calibration” is stiffness, zeros, effects and leftover together: the data tie "
    "them to each other, so that they have no shares of their own; of K and E0 only "
    "the product matters. The loss of modulus per kelvin stands alone only where it "
    "is the prior's."
)
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
        fitted = outlook.posterior.problem.discrepancy is not None
        source = "the fitted leftover discrepancy" if fitted else "the prior only"
        length = outlook.values["gap_length"] * (high - low)
        sd = outlook.values["gap_sd"] * np.sqrt(-np.expm1(-((beyond / length) ** 2)))
        yield (
            f"Extrapolated: {at:g} mm lies {beyond:.3g} mm outside the tested "
            f"{low:g} … {high:g} mm. Widened by a leftover discrepancy of "
            f"{np.sqrt(np.mean(sd**2)):.2g} N (sd), from {source}."
        )
    sense = -1.0 if question.down else 1.0
    if sense not in np.asarray(records.sense):
        word = "unloading" if question.down else "loading"
        yield f"Extrapolated: {word} was not tested; nothing widens the bounds for it."
    if _outside(records.temperature, temperature):
        found = outlook.posterior.diagnoses.get("alpha")
        by_data = found is not None and found.driven_by == "data"
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
        yield (
            "The load on the gear: without the gauge's zero, its errors and its noise. "
            "A leftover discrepancy counts as the gear's."
        )
        if first.population == "mountings":
            yield (
                "Mountings differ by the gauge's zero, which is no load: here they "
                "are alike."
            )
    own_zero = first.population != "readings" and first.quantity == "reading"
    for name, what, count in (
        ("specimen_sd", "gears", problem.specimens * (first.population == "specimens")),
        ("run_offset_sd", "mountings", problem.runs * own_zero),
    ):
        found = posterior.diagnoses.get(name)
        if count and found is not None and found.driven_by == "prior":
            yield (
                f"How much {what} differ rests on the prior: {count} were too few to "
                "tell."
            )
    if first.nodes.factor.size > 1 and first.population == "specimens":
        yield (
            "The tolerances come on top of how much the tested gears differ, which "
            "already holds their own."
        )
    elif first.nodes.factor.size > 1:
        yield (
            "With tolerances the forces are those of gears that differ from the tested "
            "ones in these sizes and in nothing else."
        )
    if all(outlook.posterior.problem.discrepancy is None for _, outlook in outlooks):
        yield from misfits(posterior)
    if (rare is not None and rare < 1.0 / draws) or rounded_tail:
        yield (
            "Such rare cases rest on the normal tails of noise and scatter, which no "
            "test of this size has seen."
        )
    total = sum(len(outlook.posterior.draws["K"]) for _, outlook in outlooks)
    if draws < total:
        yield f"{draws} of {total} draws were used."
