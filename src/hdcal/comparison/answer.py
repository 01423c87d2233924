"""The JSON answer of a comparison: what each number in it is."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hdcal.report.answer import Answer, Count, Probability, Promise, Sentences, Words
from hdcal.report.parameters import Interval


@dataclass(frozen=True)
class Compared:
    """One result beside the first; 95 % credible intervals.

    Attributes:
        name: of the result.
        rows: readings that it rests on.
        stiffness_N_per_mm: as read.
        difference_N_per_mm: from the first result's; 0 of the first itself.
        difference_percent: of the first's.
        probability_stiffer: that it is stiffer than the first.
        probability_differs: that they differ by more than the tolerance; None without.
    """

    name: Words
    rows: Count
    stiffness_N_per_mm: Interval
    difference_N_per_mm: Interval
    difference_percent: Interval
    probability_stiffer: Probability
    probability_differs: Probability | None


@dataclass(frozen=True, kw_only=True)
class ComparisonAnswer(Answer):
    """What `hdcal compare` answers; summary.json.

    Attributes:
        results: as they were given; the first one is the reference.
        tolerance_N_per_mm: difference that matters; None where none was stated.
        interval: probability that every interval holds.
        notes: on what the comparison rests.
        seed: of the pairs of draws.
        versions: of the packages that made it.
    """

    schema: Literal["hdcal.compare/1"] = "hdcal.compare/1"
    results: tuple[Compared, ...]
    tolerance_N_per_mm: float | None
    interval: Annotated[float, Promise(exclusiveMinimum=0, exclusiveMaximum=1)]
    notes: Sentences
    seed: Count
    versions: Annotated[dict[str, str], Promise(required=["hdcal"])]
