"""The score of a blind check: answers against labels, as plain data."""

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from hdcal.blind.label import Answer, Label
from hdcal.blind.scoring import order, tables
from hdcal.blind.scoring.bar import bar
from hdcal.blind.scoring.detection import METHOD, detection
from hdcal.blind.scoring.judged import Judged, judged_cases
from hdcal.blind.scoring.proper import FLOOR, brier, log_score
from hdcal.blind.scoring.reliability import (
    ESTIMATOR,
    LEAST_STATED,
    calibration,
    effect_statements,
    top_statements,
)

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
    "order": " ".join((order.__doc__ or "").split()),
}


def score(
    labels: Sequence[Label],
    answers: Mapping[str, Sequence[Answer]],
    families: Mapping[str, str],
    closures: Mapping[str, float] | None = None,
    calibration_cases: set[str] | None = None,
    judged: str = JUDGED,
) -> dict[str, Any]:
    """Return every score of a blind check, as plain data for JSON.

    Args:
        labels: the truth, as the opened seal shows it.
        answers: by diagnoser; who is judged must answer every case, the others
            stand beside it and are scored on what they answered.
        families: family of each effect of the library.
        closures: case → true closed share of the best fit of the true effect's form.
        calibration_cases: cases drawn as the prior says; None for all.
        judged: the diagnoser whose answers are held against the bar.

    Raises:
        InputError: who is judged left cases out, somebody answered one twice or one
            that does not exist, or stated probabilities that are none.
    """
    found = {
        name: judged_cases(labels, said, name=name, all_of_them=name == judged)
        for name, said in {judged: (), **answers}.items()
    }
    own, known = found[judged], closures or {}
    rows = [row.plain() for row in bar(own, known, calibration_cases)]
    confused = tables.confusion(own, families)
    return {
        "schema": SCHEMA,
        "diagnoser": judged,
        "cases": {"n": len(own), "kinds": dict(Counter(x.kind for x in labels))},
        "bar": rows,
        "summary": {word: sum(r["met"] is m for r in rows) for m, word in _WORDS},
        "log_score": {name: log_score(c).plain() for name, c in found.items()},
        "brier": {name: brier(c).plain() for name, c in found.items()},
        "confusion": confused,
        "mix_ups": tables.mix_ups(confused),
        "reliability": reliability(own, calibration_cases),
        "detection": detection(own),
        **groups(own, families, known),
        "pairs": tables.pairs(own),
        "rivals": [
            *(tables.rival_row(name, cases) for name, cases in found.items()),
            tables.oracle_row(own),
        ],
        "order": order.order_dependence(own),
        "notes": NOTES,
    }


def order_dependence(
    labels: Sequence[Label], answers: Sequence[Answer]
) -> dict[str, Any]:
    """Return how answers go with the order of the files; see `scoring.order`."""
    cases = judged_cases(labels, answers, name="answers", all_of_them=False)
    return order.order_dependence(cases)


def reliability(cases: Sequence[Judged], chosen: set[str] | None) -> dict[str, Any]:
    """Return the reliability tables: of the first hypothesis and of the effects.

    Args:
        cases: of one diagnoser.
        chosen: names of the cases to use; None for all.
    """
    own = [c for c in cases if chosen is None or c.label.case in chosen]
    wanted = {
        "top": top_statements(own),
        "effects": effect_statements(own, least=LEAST_STATED),
    }
    result: dict[str, Any] = {}
    for name, statements in wanted.items():
        found, table = calibration(statements)
        result[name] = {**found.plain(), **table}
    names = sorted({name for case in own for name in case.answer.inclusion})
    result["classwise"] = [
        {"effect": name, **calibration(effect_statements(own, name))[0].plain()}
        for name in names
    ]
    return result


def groups(
    cases: Sequence[Judged], families: Mapping[str, str], closures: Mapping[str, float]
) -> dict[str, list]:
    """Return the same numbers by size, program, noise, effect and family."""
    summed = partial(tables.numbers, families=families, closures=closures)
    known = [c for c in cases if c.plain_effect]

    def family(case: Judged) -> str:
        return families.get(case.label.truth[0], "no family")

    return {
        "by_r": tables.by_size(cases, summed),
        "by_program": tables.by(cases, lambda c: c.label.program, summed),
        "by_noise": tables.by(cases, tables.noise_word, summed),
        "by_effect": tables.by(known, lambda c: c.label.truth[0], summed),
        "by_family": tables.by(known, family, summed),
    }
