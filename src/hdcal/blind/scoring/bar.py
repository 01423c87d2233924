"""The bar: what was promised before the seal was opened, row by row."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from hdcal.blind.scoring.estimates import Estimate, mean, share
from hdcal.blind.scoring.judged import Judged
from hdcal.blind.scoring.order import order_dependence
from hdcal.blind.scoring.reliability import (
    LEAST_STATED,
    calibration,
    effect_statements,
    top_statements,
)
from hdcal.blind.scoring.sizes import (
    amplitude_rows,
    closed_errors,
    gap_rows,
)

Direction = Literal["at least", "at most", "within"]
Target = float | tuple[float, float] | None


@dataclass(frozen=True)
class Row:
    """One promise.

    Attributes:
        key: by which code knows it.
        what: in words.
        found: what came out.
        target: a number, two of them where the value must lie between, or None.
        direction: on which side of the target the value must lie.
        unit: share, points, effects or p.
    """

    key: str
    what: str
    found: Estimate
    target: Target = None
    direction: Direction | None = None
    unit: str = "share"

    @property
    def met(self) -> bool | None:
        """Whether the value, not its interval, is on the right side."""
        return self._holds(self.found.value)

    @property
    def firm(self) -> bool | None:
        """Whether the whole interval is on the side where the value is."""
        ends = [self._holds(end) for end in (self.found.lo, self.found.hi)]
        return None if None in ends else ends == [self.met, self.met]

    def _holds(self, value: float | None) -> bool | None:
        if value is None or self.target is None:
            return None
        if isinstance(self.target, tuple):
            return self.target[0] - 1e-9 <= value <= self.target[1] + 1e-9
        if self.direction == "at least":
            return value >= self.target - 1e-9
        return value <= self.target + 1e-9

    def plain(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        target = list(self.target) if isinstance(self.target, tuple) else self.target
        return {
            "key": self.key,
            "what": self.what,
            **self.found.plain(),
            "target": target,
            "direction": self.direction,
            "unit": self.unit,
            "met": self.met,
            "firm": self.firm,
        }


def bar(
    cases: Sequence[Judged],
    closures: Mapping[str, float],
    calibration_cases: set[str] | None,
) -> list[Row]:
    """Return every row of the bar.

    Args:
        cases: of the judged diagnoser.
        closures: true closed share of the best fit of the true effect's own form.
        calibration_cases: cases drawn as the prior says; None for all.
    """
    return [
        *gate_rows(cases),
        *cause_rows(cases),
        *set_rows(cases),
        *foreign_rows(cases),
        *size_rows(cases, closures),
        *calibration_rows(cases, calibration_cases),
        order_row(cases),
    ]


def quiet(cases: Sequence[Judged], noise: str) -> list[Judged]:
    """Return the cases without a gap in one kind of noise, serial up to .5."""
    own = [c for c in cases if c.label.kind == "null" and c.label.noise == noise]
    return [c for c in own if noise != "ar" or c.label.correlation <= 0.5 + 1e-9]


def gate_rows(cases: Sequence[Judged]) -> list[Row]:
    """Return the rows on gaps seen where there is none, and missed where there is."""
    iid = share(c.answer.detected for c in quiet(cases, "iid"))
    serial = share(c.answer.detected for c in quiet(cases, "ar"))
    named = share(c.named for c in cases if c.label.kind == "null")
    seen = share(
        c.answer.detected
        for c in cases
        if c.label.kind == "effect" and c.label.r * c.label.rows**0.5 >= 5.0
    )
    white = "false alarms without a gap, independent noise"
    words = "false alarms without a gap, serial noise up to 0.5"
    return [
        Row("false_alarm_iid", white, iid, 0.05, "at most"),
        Row("false_alarm_ar", words, serial, 0.05, "at most"),
        Row("named_on_null", "an effect named without a gap", named, 0.01, "at most"),
        Row("detected", "effects detected from r√n = 5 on", seen, 0.9, "at least"),
    ]


def cause_rows(cases: Sequence[Judged]) -> list[Row]:
    """Return the rows on the true effect being the most probable one."""
    known = [c for c in cases if c.plain_effect]
    rows = []
    for r, target, most in ((1.0, 0.9, 0.04), (0.5, 0.7, 0.08)):
        own = [c for c in known if c.at(r) and c.label.program == "rich"]
        oracle = [c for c in own if c.label.oracle]
        words, key = f"at r = {r:g}, rich program", f"r{r:g}"
        found = share(c.credit for c in own)
        away = mean([c.oracle_credit - c.credit for c in oracle])
        what = f"true effect first {words}"
        rows.append(Row(f"top1_rich_{key}", what, found, target, "at least"))
        what = f"short of the oracle {words}"
        rows.append(Row(f"oracle_{key}", what, away, most, "at most", "points"))
    middle = share(c.credit for c in known if c.between(1.0, 2.0))
    large = share(c.credit for c in known if c.at(5.0))
    words = "true effect first at r = 1 to 2, all programs"
    rows.append(Row("top1_r1_2", words, middle, 0.85, "at least"))
    words = "true effect first at r = 5, all programs"
    rows.append(Row("top1_r5", words, large, 0.7, "at least"))
    return rows


def set_rows(cases: Sequence[Judged]) -> list[Row]:
    """Return the rows on the 90 % set, and on how far a name can be relied on."""
    known = [c for c in cases if c.plain_effect]
    held = share(c.label.truth[0] in c.answer.set for c in known if c.label.r >= 0.475)
    size = mean([float(len(c.answer.set)) for c in known if c.at(1.0)])
    name = share(c.named_right for c in cases if c.named and not c.label.withheld)
    words = "90 % set holds the true effect, r ≥ 0.5"
    what = "a named effect is a true one, all kinds of cases"
    return [
        Row("set_holds", words, held, 0.9, "at least"),
        Row(
            "set_size", "size of the 90 % set at r = 1", size, 1.6, "at most", "effects"
        ),
        Row("precision", what, name, 0.95, "at least"),
    ]


def foreign_rows(cases: Sequence[Judged]) -> list[Row]:
    """Return the rows on causes that the library does not hold."""
    rows = []
    for spanned, least, most in ((True, 0.9, 0.05), (False, 0.7, 0.1)):
        own = [
            c
            for c in cases
            if c.label.kind == "outside"
            and c.label.spanned is spanned
            and c.label.r >= 0.95
        ]
        key = "spanned" if spanned else "unspanned"
        words = "outside the library, " + (
            "of the list given beforehand" if spanned else "chosen blind"
        )
        unknown = share(c.answer.verdict == "unknown" for c in own)
        named = share(c.named for c in own)
        what = f"{words}: called unknown"
        rows.append(Row(f"unknown_{key}", what, unknown, least, "at least"))
        what = f"{words}: an effect named"
        rows.append(Row(f"named_{key}", what, named, most, "at most"))
    taken = share(c.named for c in cases if c.withheld and c.at(1.0))
    what = "true effect withheld, r = 1: another named"
    return [*rows, Row("named_withheld", what, taken, 0.2, "at most")]


def size_rows(cases: Sequence[Judged], closures: Mapping[str, float]) -> list[Row]:
    """Return the rows on sizes, at r = 1."""
    own = [c for c in cases if c.at(1.0)]
    amplitude, gap = amplitude_rows(own), gap_rows(own)
    return [
        Row("amplitude", "error of the amplitude", amplitude.error, 0.07, "at most"),
        Row(
            "amplitude_holds",
            "90 % interval holds the amplitude",
            amplitude.held,
            (0.85, 0.95),
            "within",
        ),
        Row("gap", "error of the gap's size", gap.error),
        Row("gap_holds", "90 % interval holds the gap's size", gap.held),
        Row(
            "closed",
            "error of the closed share, true effect named",
            closed_errors(own, closures),
            0.08,
            "at most",
            "points",
        ),
    ]


def calibration_rows(cases: Sequence[Judged], chosen: set[str] | None) -> list[Row]:
    """Return the rows on stated probabilities."""
    own = [c for c in cases if chosen is None or c.label.case in chosen]
    top, _ = calibration(top_statements(own))
    each, _ = calibration(effect_statements(own, least=LEAST_STATED))
    words = "calibration error of the most probable hypothesis"
    what = "calibration error of single effects given 5 % or more"
    return [
        Row("calibration_top", words, top, 0.05, "at most"),
        Row("calibration_effects", what, each, 0.05, "at most"),
    ]


def order_row(cases: Sequence[Judged]) -> Row:
    """Return the row on answers that go with the order of the files."""
    found = order_dependence(cases)
    p = found["p_value"]
    n = found["n"] if p is not None else 0
    words = "answers depend on file order: p-value that they do not"
    estimate = Estimate(p, None, None, n, "permutation test")
    return Row("order", words, estimate, 0.01, "at least", "p")
