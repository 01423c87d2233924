"""The score of a blind check: answers against labels."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.scoring import file_order, tables
from hdcal.blind.scoring.bar import BarResult, bar
from hdcal.blind.scoring.detection import METHOD, DetectionCurve, detection
from hdcal.blind.scoring.estimates import Estimate
from hdcal.blind.scoring.file_order import (
    FileOrder,
    NeighbourTests,
    order_dependence,
)
from hdcal.blind.scoring.groups import groups
from hdcal.blind.scoring.proper_scores import FLOOR, brier_score, log_score
from hdcal.blind.scoring.reliability import ESTIMATOR, Reliabilities, reliabilities
from hdcal.blind.scoring.scored_case import match_answers

JUDGED = "hdcal"
NOTES = {
    "met": (
        "Met compares the value itself with the target; firm says whether the whole "
        "interval lies on that side. No cases: neither met nor missed."
    ),
    "top1": (
        "The most probable of the effects by inclusion is the true one, whatever the "
        "verdict; a tie of k counts 1/k. Cases with one effect, none withheld."
    ),
    "r": "Sizes are taken within 5 %: r = 1 is 0.95 to 1.05.",
    "oracle": (
        "Bayes' rule of who knows r, σ and the rig, over mechanisms; no gap and "
        "unknown are left out of its ranking."
    ),
    "hypotheses": (
        "Truth is none without a gap, the pair for two effects, unknown outside the "
        "library and where a true effect is withheld; real data is not scored here."
    ),
    "log_score": f"Mean of log p(truth) in nats; p is at least {FLOOR:g}.",
    "brier": "Squared distance over all hypotheses, from 0 to 2.",
    "precision": "Cases with a withheld effect do not count.",
    "calibration": ESTIMATOR,
    "detection": METHOD,
    "order": " ".join((file_order.__doc__ or "").split()),
}


@dataclass(frozen=True)
class CaseCounts:
    """How many cases were judged, and how many labels are of each kind."""

    n: int
    kinds: dict[str, int]


@dataclass(frozen=True)
class Summary:
    """How many rows of the bar were met, were missed, or have no target or no cases."""

    met: int
    missed: int
    open: int


@dataclass(frozen=True, kw_only=True)
class Scores:
    """Every score of a blind check, as in scores.json; `notes` says how they are made.

    Those by diagnoser and `rivals` are of all who answered, the others of `diagnoser`.
    """

    schema: Literal["hdcal.blind-scores/1"] = "hdcal.blind-scores/1"
    diagnoser: str
    cases: CaseCounts
    bar: list[BarResult]
    summary: Summary
    log_score: dict[str, Estimate]
    brier: dict[str, Estimate]
    confusion: tables.Confusion
    mix_ups: list[tables.MixUp]
    reliability: Reliabilities
    detection: list[DetectionCurve]
    by_r: list[tables.Row]
    by_program: list[tables.Row]
    by_noise: list[tables.Row]
    by_effect: list[tables.Row]
    by_family: list[tables.Row]
    pairs: tables.Row
    rivals: list[tables.Row]
    order: NeighbourTests | FileOrder
    notes: dict[str, str] = field(default_factory=lambda: NOTES)


def score(
    labels: Sequence[Label],
    answers: Mapping[str, Sequence[CaseAnswer]],
    families: Mapping[str, str],
    closures: Mapping[str, float] | None = None,
    calibration_cases: set[str] | None = None,
    judged: str = JUDGED,
) -> Scores:
    """Return every score of a blind check.

    Args:
        labels: the truth, as the opened seal shows it.
        answers: by diagnoser; only who is judged must answer every case.
        families: family of each effect of the library.
        closures: case → true closed share of the best fit of the true effect's form.
        calibration_cases: cases drawn as the prior says; None for all.
        judged: the diagnoser whose answers are held against the bar.

    Raises:
        InputError: as `match_answers`.
    """
    found = {
        name: match_answers(labels, said, name=name, all_of_them=name == judged)
        for name, said in {judged: (), **answers}.items()
    }
    own, known = found[judged], closures or {}
    everyone = {label.case for label in labels}
    wanted = everyone if calibration_cases is None else calibration_cases
    stated = reliabilities([case for case in own if case.label.case in wanted])
    order = order_dependence(own)
    rows = bar(own, known, stated, order, families)
    confused = tables.confusion(own, families)
    return Scores(
        diagnoser=judged,
        cases=CaseCounts(len(own), dict(Counter(x.kind for x in labels))),
        bar=rows,
        summary=Summary(*(sum(r.met is m for r in rows) for m in (True, False, None))),
        log_score={name: log_score(c) for name, c in found.items()},
        brier={name: brier_score(c) for name, c in found.items()},
        confusion=confused,
        mix_ups=tables.mix_ups(confused),
        reliability=stated,
        detection=detection(own),
        **groups(own, families, known),
        pairs=tables.pairs(own),
        rivals=tables.rivals(found, own),
        order=order,
    )
