"""Labels and answers in a few words, for examples that a hand can reckon."""

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.scoring.bar import BarResult
from hdcal.blind.scoring.file_order import FileOrder, order_dependence
from hdcal.blind.scoring.scored_case import match_answers
from hdcal.blind.scoring.scores import Scores, score

KINDS = {"slack": "rig", "friction": "rig", "drift": "time"}


def truth(case="a", kind="effect", names=("slack",), r=1.0, **more) -> Label:
    plain = {"program": "rich", "rows": 100, "noise": "iid", "correlation": 0.0}
    return Label(case, kind, names, r=r, sigma=1.0, **{**plain, **more})


def said(case="a", verdict="named", effect="slack", chances=None, **more) -> CaseAnswer:
    chances = chances or {effect or "none": 1.0}
    inclusion = {n: p for n, p in chances.items() if n not in ("none", "unknown")}
    plain = {"inclusion": inclusion, "detected": True, "set": tuple(chances)}
    return CaseAnswer(
        case, verdict, effect, None, probabilities=chances, **{**plain, **more}
    )


def scored(labels, answers, **more) -> Scores:
    return score(labels, {"hdcal": answers}, KINDS, **more)


def order_of(labels, answers) -> FileOrder:
    """Return how answers go with the order of the files."""
    cases = match_answers(labels, answers, name="answers", all_of_them=False)
    return order_dependence(cases)


def row(found: Scores, key: str) -> BarResult:
    return next(row for row in found.bar if row.key == key)
