"""The bar: what was promised before the seal was opened, and what was found."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from hdcal.blind.scoring.estimates import Estimate, mean, share
from hdcal.blind.scoring.file_order import FileOrder
from hdcal.blind.scoring.reliability import Reliabilities
from hdcal.blind.scoring.scored_case import UNKNOWN, Cases, null_cases
from hdcal.blind.scoring.sizes import amplitude_sizes, closed_errors, gap_sizes
from hdcal.blind.scoring.tables import precision

Direction = Literal["at least", "at most", "within"]


@dataclass(frozen=True)
class _Titles:
    key: str
    what: str


@dataclass(frozen=True)
class BarResult(Estimate, _Titles):
    """One promise with what was found: met by the value, firm by its interval."""

    target: float | tuple[float, float] | None
    direction: Direction | None
    unit: str
    met: bool | None
    firm: bool | None


@dataclass(frozen=True)
class BarRow:
    """One promise.

    Attributes:
        what: in words.
        direction: on which side of the target the value must lie.
        target: a number, two of them where the value must lie between, or None.
        unit: share, points, effects or p.
    """

    what: str
    direction: Direction | None = None
    target: float | tuple[float, float] | None = None
    unit: str = "share"

    def met_by(self, value: float | None) -> bool | None:
        """Tell whether a value is on the right side; None without one or a target."""
        if value is None or self.target is None:
            return None
        if isinstance(self.target, tuple):
            return self.target[0] - 1e-9 <= value <= self.target[1] + 1e-9
        if self.direction == "at least":
            return value >= self.target - 1e-9
        return value <= self.target + 1e-9

    def compared(self, key: str, found: Estimate) -> BarResult:
        """Return the promise with what was found."""
        met = self.met_by(found.value)
        ends = [self.met_by(found.lo), self.met_by(found.hi)]
        return BarResult(
            key=key,
            value=found.value,
            lo=found.lo,
            hi=found.hi,
            n=found.n,
            interval=found.interval,
            met=met,
            firm=None if None in ends else ends == [met, met],
            **vars(self),
        )


_LISTED = "outside the library, of the list given beforehand"
_CHOSEN = "outside the library, chosen blind"
_SERIAL = "false alarms without a gap, serial noise up to 0.5"
_R2, _R1, _R05 = (f"at r = {r}, rich program" for r in (2, 1, 0.5))
_TOP = "calibration error of the most probable hypothesis"
_EACH = "calibration error of single effects given 5 % or more"
_ORDER = "answers depend on file order: p-value that they do not"
ROWS = {
    "false_alarm_iid": BarRow(
        "false alarms without a gap, independent noise", "at most", 0.05
    ),
    "false_alarm_ar": BarRow(_SERIAL, "at most", 0.05),
    "false_alarm_strong": BarRow(
        "false alarms without a gap, serial noise of 0.5 to 0.95", "at most", 0.05
    ),
    "false_alarm_log": BarRow(
        "false alarms without a gap, oversampled logs", "at most", 0.05
    ),
    "named_on_null": BarRow("an effect named without a gap", "at most", 0.01),
    "detected": BarRow("effects detected from r√n = 5 on", "at least", 0.9),
    "top1_rich_r1": BarRow(f"true effect first {_R1}", "at least", 0.94),
    "oracle_r1": BarRow(f"short of the oracle {_R1}", "at most", 0.04, "points"),
    "top1_rich_r0.5": BarRow(f"true effect first {_R05}", "at least", 0.78),
    "oracle_r0.5": BarRow(f"short of the oracle {_R05}", "at most", 0.08, "points"),
    "top1_r1_2": BarRow(
        "true effect first at r = 1 to 2, all programs", "at least", 0.85
    ),
    "top1_r5": BarRow("true effect first at r = 5, all programs", "at least", 0.7),
    "group_r1": BarRow(f"true group first {_R1}", "at least", 0.97),
    "group_r2": BarRow(f"true group first {_R2}", "at least", 0.99),
    "top1_rich_r2": BarRow(f"true effect first {_R2}", "at least", 0.98),
    "said_r2": BarRow(f"a group or an effect said {_R2}", "at least", 0.9),
    "said_right": BarRow(
        "a group that is said is a true one, all kinds of cases", "at least", 0.99
    ),
    "set_holds": BarRow("90 % set holds the true effect, r ≥ 0.5", "at least", 0.9),
    "set_size": BarRow("size of the 90 % set at r = 1", "at most", 1.6, "effects"),
    "precision": BarRow(
        "a named effect is a true one, all kinds of cases", "at least", 0.98
    ),
    "unknown_spanned": BarRow(f"{_LISTED}: called unknown", "at least", 0.9),
    "named_spanned": BarRow(f"{_LISTED}: an effect named", "at most", 0.05),
    "unknown_unspanned": BarRow(f"{_CHOSEN}: called unknown", "at least", 0.88),
    "named_unspanned": BarRow(f"{_CHOSEN}: an effect named", "at most", 0.04),
    "named_withheld": BarRow(
        "true effect withheld, r = 1: another named", "at most", 0.1
    ),
    "withheld_own": BarRow(
        "true effect withheld, r = 1: its own group, or unknown",
        "at least",
        0.85,
    ),
    "composite_wrong": BarRow(
        "an effect and something outside: a wrong effect named", "at most", 0.05
    ),
    "amplitude": BarRow("error of the amplitude", "at most", 0.07),
    "amplitude_holds": BarRow(
        "95 % interval holds the amplitude", "within", (0.90, 0.98)
    ),
    "gap": BarRow("error of the gap's size"),
    "gap_holds": BarRow("95 % interval holds the gap's size", "within", (0.90, 0.98)),
    "closed": BarRow(
        "error of the closed share, true effect named", "at most", 0.08, "points"
    ),
    "calibration_top": BarRow(_TOP, "at most", 0.05),
    "calibration_effects": BarRow(_EACH, "at most", 0.05),
    "order": BarRow(_ORDER, "at least", 0.01, "p"),
}


def bar(
    cases: Cases,
    closures: Mapping[str, float],
    stated: Reliabilities,
    order: FileOrder,
    families: Mapping[str, str],
) -> list[BarResult]:
    """Return every row of the bar with what was found.

    Args:
        cases: of the diagnoser whose answers are held against it.
        closures: true closed share of the best fit of the true effect's own form.
        stated: from `reliabilities`.
        order: from `order_dependence`.
        families: group of each effect.
    """
    p = order.p_value
    n = order.n if p is not None else 0
    found = {
        **_detections(cases),
        **_causes(cases),
        **_levels(cases, families),
        **_sizes(cases, closures),
        "calibration_top": stated.top,
        "calibration_effects": stated.effects,
        "order": Estimate(p, None, None, n, "permutation test"),
    }
    return [row.compared(key, found[key]) for key, row in ROWS.items()]


def _detections(cases: Cases) -> dict[str, Estimate]:
    null = [c for c in cases if c.label.kind == "null"]
    effects = [c for c in cases if c.label.kind == "effect"]
    large = [c for c in effects if c.label.r * c.label.rows**0.5 >= 5.0]
    return {
        "false_alarm_iid": share(c.answer.detected for c in null_cases(cases, "iid")),
        "false_alarm_ar": share(c.answer.detected for c in null_cases(cases, "ar")),
        "false_alarm_strong": share(
            c.answer.detected for c in null_cases(cases, "strong")
        ),
        "false_alarm_log": share(c.answer.detected for c in null_cases(cases, "log")),
        "named_on_null": share(c.named for c in null),
        "detected": share(c.answer.detected for c in large),
    }


def _causes(cases: Cases) -> dict[str, Estimate]:
    known = [c for c in cases if c.plain_effect]
    at_1, some = (
        [c for c in known if c.at(1.0)],
        [c for c in known if c.label.r >= 0.475],
    )
    found = {
        "top1_r1_2": share(c.credit for c in known if c.between(1.0, 2.0)),
        "top1_r5": share(c.credit for c in known if c.at(5.0)),
        "set_holds": share(c.label.truth[0] in c.answer.set for c in some),
        "set_size": mean([float(len(c.answer.set)) for c in at_1]),
        "precision": precision(cases),
        "named_withheld": share(c.named for c in cases if c.withheld and c.at(1.0)),
    }
    for r in (1.0, 0.5):
        own = [c for c in known if c.at(r) and c.label.program == "rich"]
        short = [c.oracle_credit - c.credit for c in own if c.label.oracle]
        found[f"top1_rich_r{r:g}"] = share(c.credit for c in own)
        found[f"oracle_r{r:g}"] = mean(short)
    outside = [c for c in cases if c.label.kind == "outside" and c.label.r >= 0.95]
    for word, spanned in (("spanned", True), ("unspanned", False)):
        own = [c for c in outside if c.label.spanned is spanned]
        found[f"unknown_{word}"] = share(c.answer.verdict == UNKNOWN for c in own)
        found[f"named_{word}"] = share(c.named for c in own)
    return found


def _levels(cases: Cases, families: Mapping[str, str]) -> dict[str, Estimate]:
    """Return what is said on the level of groups."""
    known = [c for c in cases if c.plain_effect and c.label.program == "rich"]
    at_1, at_2 = ([c for c in known if c.at(r)] for r in (1.0, 2.0))
    withheld = [c for c in cases if c.withheld and c.at(1.0)]
    told = [c for c in withheld if c.said or c.answer.verdict == UNKNOWN]
    mixed = [c for c in cases if c.label.kind == "composite"]
    return {
        "group_r1": share(c.first_group_right(families) for c in at_1),
        "group_r2": share(c.first_group_right(families) for c in at_2),
        "top1_rich_r2": share(c.credit for c in at_2),
        "said_r2": share(c.said for c in at_2),
        "said_right": share(
            c.said_right(families) for c in cases if c.said and not c.label.withheld
        ),
        "withheld_own": share(not c.said or c.said_right(families) for c in told),
        "composite_wrong": share(c.named and not c.named_right for c in mixed),
    }


def _sizes(cases: Cases, closures: Mapping[str, float]) -> dict[str, Estimate]:
    own = [c for c in cases if c.at(1.0)]
    amplitude, gap = amplitude_sizes(own), gap_sizes(own)
    return {
        "amplitude": amplitude.error,
        "amplitude_holds": amplitude.held,
        "gap": gap.error,
        "gap_holds": gap.held,
        "closed": closed_errors(own, closures),
    }
