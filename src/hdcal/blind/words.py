"""The numbers of a blind check as the texts of tables."""

from collections.abc import Mapping

from hdcal.blind.label import CaseAnswer, Label
from hdcal.blind.scoring.bar import BarResult
from hdcal.blind.scoring.detection import DetectionCurve
from hdcal.blind.scoring.estimates import Estimate
from hdcal.report.document import Cell, Tag, Tone
from hdcal.report.words import hypothesis, number, percent

_MET = {True: "met", False: "missed", None: "–"}
_TONES: Mapping[str, Tone] = {"met": "good", "missed": "bad"}
_TRUTHS = {
    "pair": "two effects",
    "outside": "outside the library",
    "withheld": "withheld effect",
    "real": "real data",
    "unknown": "unknown",
}


def truth_word(name: str) -> str:
    """Return a row or column of the confusion matrix as people say it."""
    return _TRUTHS.get(name) or hypothesis(name)


def bar_row(row: BarResult) -> list[Cell]:
    """Return a row of the bar as texts, in the order of the columns."""
    word = _MET[row.met]
    if row.met is None:
        word = "no cases" if row.value is None else "no target"
    elif not row.firm and row.firm is not None:
        # Chance could turn it: the interval reaches across the target.
        word += ", not firmly"
    return [
        row.what,
        Tag(word, _TONES.get(word.split(",")[0], "neutral")),
        shown(row.value, row.unit),
        target(row),
        span(row, row.unit),
        str(row.n),
        row.interval,
    ]


def shown(value: float | None, unit: str = "share") -> str:
    """Return a number as its unit wants it written."""
    if value is None:
        return "–"
    if unit == "p":
        return "< 0.01" if value < 0.01 else f"{value:.2f}"
    words = f"{value:.2f}" if unit in ("effects", "nat") else f"{100.0 * value:.1f}"
    ending = {"points": " points", "share": " %"}.get(unit, "")
    return words.replace("-", "−") + ending


def span(entry: Estimate, unit: str = "share") -> str:
    """Return an interval."""
    if entry.lo is None or entry.hi is None:
        return "–"
    low, high = shown(entry.lo, unit), shown(entry.hi, unit)
    for end in (" %", " points"):
        low = low.removesuffix(end)
    return f"{low} … {high}"


def target(row: BarResult) -> str:
    """Return what was promised."""
    wanted = row.target
    if wanted is None:
        return "–"
    if isinstance(wanted, tuple):
        return f"{percent(wanted[0]).removesuffix(' %')} … {percent(wanted[1])}"
    if row.unit == "p":
        words = f"{wanted:g}"
    elif row.unit == "points":
        words = f"{100.0 * wanted:g} points"
    else:
        words = f"{wanted:g}" if row.unit == "effects" else f"{100 * wanted:g} %"
    return f"{'≥' if row.direction == 'at least' else '≤'} {words}"


def with_span(entry: Estimate | None, unit: str = "share") -> str:
    """Return a number with its interval in brackets; a dash without cases."""
    if entry is None or entry.value is None:
        return "–"
    ends = span(entry, unit)
    return shown(entry.value, unit) + (f" ({ends})" if ends != "–" else "")


def limit_row(curve: DetectionCurve) -> list[str]:
    """Return the detection limit of an effect as texts."""
    if curve.below_all:
        words = f"below {number(curve.r90)}, the smallest tried"
    elif curve.r90 is None:
        words = "not reached"
    else:
        words = f"{curve.r90:.2g}"
    low = "–" if curve.lo is None else f"{curve.lo:.2g}"
    high = "not reached" if curve.hi is None else f"{curve.hi:.2g}"
    between = "–" if curve.lo is None or curve.below_all else f"{low} … {high}"
    return [hypothesis(curve.effect), str(curve.n), words, between]


def measured_row(label: Label, answer: CaseAnswer) -> list[str]:
    """Return what was stated of a measurement and what was answered, as texts."""
    chances = {**answer.probabilities, **answer.inclusion}
    found = [f"{hypothesis(name)} {percent(chances.get(name))}" for name in answer.set]
    stated = " or ".join(map(hypothesis, label.truth))
    holds = "yes" if set(label.truth) & set(answer.set) else "no"
    return [stated, answer.verdict, ", ".join(found), holds]
