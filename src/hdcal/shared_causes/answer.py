"""The JSON answer of what gears have in common: what each number in it is."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.fleets.left_out import GearLeftOut
from hdcal.report.answer import (
    Answer,
    Count,
    Digest,
    EffectName,
    Promise,
    Real,
    Sentences,
    Words,
)
from hdcal.report.intervals import Interval


@dataclass(frozen=True)
class SharedCause:
    """One cause, over all gears; 95 % credible intervals.

    Attributes:
        cause: none, an effect by its name, several at once, or unknown.
        gears_told: gears of which it alone is told, with a probability of 0.9 or more.
        gears: how many of these gears have it.
        share: of gears to come that have it.
        log_evidence_nat: of the readings of all gears, had each one it, over none.
        name_tested: whether few other causes got this name in blind checks; None of
            what is no effect.
    """

    cause: EffectName
    gears_told: Count
    gears: Interval
    share: Interval
    log_evidence_nat: Real
    name_tested: bool | None


@dataclass(frozen=True)
class LotWithCauses:
    """A lot, and how many of its gears have any effect, or something unknown."""

    lot: Words
    gears: Count
    gears_with_effect: Interval


@dataclass(frozen=True, kw_only=True)
class CausesAnswer(Answer):
    """What `hdcal causes` answers; summary.json. Its gears are in gears.csv.

    Attributes:
        gears: how many there are.
        rows: of all of them.
        left_out: those that are bad, and in none of the numbers, where this was asked.
        causes: those that were considered, the most frequent first.
        lots: where they are told.
        not_shown: effects of the library that no readings could show.
        interval: probability that every interval holds.
        notes: from reading, and on what the answer rests.
        seed: of the draws.
        versions: of the packages that made them.
        data_sha256: of the data file.
    """

    schema: Literal["hdcal.causes/1"] = "hdcal.causes/1"
    gears: Count
    rows: Count
    left_out: tuple[GearLeftOut, ...]
    causes: tuple[SharedCause, ...]
    lots: tuple[LotWithCauses, ...]
    not_shown: tuple[Words, ...]
    interval: Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
    notes: Sentences
    seed: Count
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
    data_sha256: Digest
