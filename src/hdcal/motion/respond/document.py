"""A response in words: the only place of its sentences."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.quantities import quantity_table
from hdcal.motion.respond.answer import QuantityEstimate, ResponseAnswer
from hdcal.prediction.engine.causes import averaging_words
from hdcal.prediction.engine.pooled import Pooled
from hdcal.report.document import Document, Picture, Section, Text, notices
from hdcal.report.intervals import Interval
from hdcal.report.provenance import gear_rows
from hdcal.report.words import estimate

if TYPE_CHECKING:
    from hdcal.motion.respond.respond import Response

# Points in a period that show its peak, and the band, to the eye.
_PER_PERIOD = 10
_FROM_PRIORS = {"mass_kg": "mass", "damping_N_s_per_mm": "damping"}


def headline(peak: Interval, *, pulled: bool) -> str:
    """Return the answer in one sentence.

    Args:
        peak: largest size of the deformation [mm].
        pulled: whether the force is negative at any time: the deformation then may be.
    """
    middle, span = estimate(peak)
    size = " in size" if pulled else ""
    return (
        f"The deformation reaches {middle} mm{size}, 95 % credible interval {span} mm."
    )


def next_steps(
    posterior: Posterior, estimates: Mapping[str, QuantityEstimate]
) -> list[str]:
    """Return what would make the answer better, most urgent first."""
    if not _not_seen(posterior, {n: one.driven_by for n, one in estimates.items()}):
        return []
    return [
        "Measure a vibration and calibrate the moving gear from it, or weigh what "
        "moves and give its mass."
    ]


def _not_seen(posterior: Posterior, driven_by: Mapping[str, str]) -> list[str]:
    """Return of what a calibration at rest says nothing, nor did the user."""
    if isinstance(posterior, DynamicPosterior):
        return []
    return [w for name, w in _FROM_PRIORS.items() if driven_by[name] == "prior"]


def remarks(
    pooled: Pooled, times: np.ndarray, estimates: dict, kept, left, tested
) -> Iterator[str]:
    """Yield what the reader must know, in sentences.

    Args:
        pooled: what the answer rests on.
        times: of the answer [s].
        estimates: of the answer, with their drivers.
        kept: effects taken along.
        left: effects left out.
        tested: from `tested_rows`.
    """
    posterior = pooled.causes[0].posterior
    not_seen = _not_seen(posterior, {n: e["driven_by"] for n, e in estimates.items()})
    if not_seen:
        yield (
            "The gear was calibrated at rest, which says nothing of its "
            f"{' and '.join(not_seen)}: there the prior is the answer."
        )
    outside = np.count_nonzero(~tested)
    if outside:
        yield (
            f"{outside} of {len(tested)} times lie outside the deformations or the "
            "temperature that were calibrated: extrapolated."
        )
    yield from averaging_words(pooled.causes)
    if left:
        listed = ", ".join(effect.name for effect in left)
        yield (
            "Left out, because they remember what came before or belong to gauges and "
            f"sensors: {listed}."
        )
    gap = None if pooled.moving else pooled.problem.discrepancy
    if gap is not None and gap.looped:
        yield (
            "Of the leftover the middle of loading and unloading acts: what its loop "
            "would damp is left out."
        )
    if kept:
        yield "Frequency, damping and stiffness are those without the effects."
    step = float(np.median(np.diff(times)))
    highest = estimates["natural_frequency_Hz"]["hi"]
    if highest * step > 1.0 / _PER_PERIOD:
        yield (
            f"A natural frequency of up to {highest:.4g} Hz swings too fast for the "
            f"{1.0 / step:.4g} times per second, fewer than {_PER_PERIOD} in a period: "
            "for its peaks use more points or a shorter duration."
        )
    if len(pooled.case.specimen_labels) > 1:
        yield "The stiffness is the mean of the tested gears, not of a new one."


def response_document(
    response: "Response", found: ResponseAnswer, command: str = ""
) -> Document:
    """Return the report; its picture is called response."""
    posterior = response.posterior
    provenance = [
        *gear_rows(posterior.case, posterior.theory),
        ("calibrated", found.calibration),
        ("gears integrated", str(found.draws)),
    ]
    return Document(
        name=found.gear,
        kind="response",
        subtitle=f"Response to {found.force} at {found.temperature_C:g} °C, from rest.",
        headline=found.headline,
        next_steps=next_steps(posterior, found.estimates),
        notices=notices(("To be aware of", found.remarks)),
        sections=[_motion(), _gear(found)],
        provenance=provenance + ([("command", command)] if command else []),
    )


def _motion() -> Section:
    picture = Picture(
        "response",
        "Force over time, and the credible band of the deformation",
        "The band holds the deformation with 95 % probability at each time taken by "
        "itself. Gears of different frequency get out of step, so that late in a "
        "vibration the band is wide and its median swings less than any one gear. "
        "Hatched or dotted: outside what was calibrated. The numbers are in "
        "response.csv.",
        tall=True,
    )
    return Section("Force and deformation over time", [picture])


def _gear(found: ResponseAnswer) -> Section:
    drivers = {name: one.driven_by for name, one in found.estimates.items()}
    words = (
        "“Decided by prior” means: no data speak of it, the interval is what handbooks "
        "and judgement leave open."
    )
    if found.effects:
        listed = ", ".join(found.effects).replace("_", " ")
        words += f" Effects taken along: {listed}."
    table = quantity_table(found.estimates, drivers)
    note = Text(words, soft=True)
    return Section("What the gear is taken to be", [table, note], brief=True)
