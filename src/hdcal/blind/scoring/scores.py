"""The score of a blind check: answers against labels, as plain data."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.scoring import file_order, tables
from hdcal.blind.scoring.bar import bar
from hdcal.blind.scoring.detection import METHOD, detection
from hdcal.blind.scoring.file_order import order_dependence
from hdcal.blind.scoring.groups import groups
from hdcal.blind.scoring.proper_scores import FLOOR, brier_score, log_score
from hdcal.blind.scoring.reliability import (
    ESTIMATOR,
    effect_errors,
    reliabilities,
)
from hdcal.blind.scoring.scored_case import match_answers

SCHEMA = "hdcal.blind-scores/1"
JUDGED = "hdcal"
_WORDS = ((True, "met"), (False, "missed"), (None, "open"))
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


def score(
    labels: Sequence[Label],
    answers: Mapping[str, Sequence[CaseAnswer]],
    families: Mapping[str, str],
    closures: Mapping[str, float] | None = None,
    calibration_cases: set[str] | None = None,
    judged: str = JUDGED,
) -> dict[str, Any]:
    """Return every score of a blind check, as plain data for JSON.

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
    chosen = [case for case in own if case.label.case in wanted]
    stated, order = reliabilities(chosen), order_dependence(own)
    rows = bar(own, known, stated, order)
    confused = tables.confusion(own, families)
    return {
        "schema": SCHEMA,
        "diagnoser": judged,
        "cases": {"n": len(own), "kinds": dict(Counter(x.kind for x in labels))},
        "bar": rows,
        "summary": {word: sum(r["met"] is m for r in rows) for m, word in _WORDS},
        "log_score": {name: log_score(c).plain() for name, c in found.items()},
        "brier": {name: brier_score(c).plain() for name, c in found.items()},
        "confusion": confused,
        "mix_ups": tables.mix_ups(confused),
        "reliability": {**tables.plain(stated), "classwise": effect_errors(chosen)},
        "detection": detection(own),
        **groups(own, families, known),
        "pairs": tables.pairs(own),
        "rivals": tables.rivals(found, own),
        "order": order,
        "notes": NOTES,
    }
