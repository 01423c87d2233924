"""One run on its way through the screening, and the faults of its readings."""

from dataclasses import dataclass, field

import numpy as np

from hdcal.screening.channels import matters, saturated_rows, scatter_of_deformation
from hdcal.screening.ends import rows_before_tare
from hdcal.screening.jumps import Jump, find_jump
from hdcal.screening.result import (
    REPEATED,
    SATURATED,
    TARE,
    WILD,
    Action,
    Kind,
    Observation,
    stretches,
)
from hdcal.screening.wild import FEWEST, wild_readings

_MOST_JUMPS = 4  # more jumps than this are no faults of a zero but what the part does
_MOST_WILD = 0.1  # a larger share of wild readings is noise with heavy tails
# Share of the readings that stand in the usual number of rows, or in one more or less,
# where the logger is faster than the gauges.
_REGULAR = 0.9
_JUMPS: dict[str, tuple[Kind, str]] = {
    "force": ("jump of the force", "N"),
    "deformation": ("jump of the deformation", "mm"),
    "both": ("jump of both", "N"),
}


@dataclass
class Run:
    """One run on its way through the screening, as in `Screening`; shape (r,)."""

    index: int
    rows: np.ndarray  # in the whole record
    x: np.ndarray
    y: np.ndarray
    segment: np.ndarray
    kept: np.ndarray
    zero: np.ndarray
    scatter: float = 0.0  # sd of the deformation's reading; 0 where none shows
    plain: bool = False  # whether a straight line explains it
    observations: list[Observation] = field(default_factory=list)

    @classmethod
    def of(
        cls, rows: np.ndarray, x: np.ndarray, y: np.ndarray, index: int = 0
    ) -> "Run":
        """Return some rows of a record, all kept."""
        segment, zero = np.zeros((2, rows.size), int)
        kept = np.ones(rows.size, bool)
        return cls(index, rows, x[rows], y[rows], segment, kept, zero)

    def observe(
        self, kind: Kind, rows: np.ndarray, size: float, unit: str, action: Action
    ) -> None:
        """Add an observation of some rows of the run."""
        where = stretches(self.rows[rows])
        observed = Observation(kind, where, float(size), unit, action, self.index)
        self.observations.append(observed)

    def cut(self, rows: np.ndarray, segment: int) -> None:
        """Take rows out of the record."""
        self.kept[rows] = False
        self.segment[rows] = segment

    def distinct(self) -> np.ndarray:
        """Return the rows that are kept and do not just repeat the reading before."""
        rows = np.flatnonzero(self.kept)
        if not rows.size:
            return rows
        same = (np.diff(self.x[rows]) == 0.0) & (np.diff(self.y[rows]) == 0.0)
        return rows[np.r_[True, ~same]]

    def with_repeats(self, rows: np.ndarray) -> np.ndarray:
        """Return rows with those after each that just repeat it."""
        kept, distinct = np.flatnonzero(self.kept), self.distinct()
        first = distinct[np.searchsorted(distinct, kept, "right") - 1]
        return kept[np.isin(first, rows)]


def look_at(one: Run) -> None:
    """Find what is wrong with the readings of a run, and deal with it."""
    _repeats(one)
    if one.plain or one.x.size < FEWEST or not np.ptp(one.x) or not np.ptp(one.y):
        return
    _tare(one)
    _saturation(one)
    one.scatter = _scatter(one)
    _wild(one)
    if _jumps(one):
        _wild(one)
    rows = np.flatnonzero(one.kept)
    one.scatter = _scatter(one) if one.scatter else 0.0
    if not matters(one.scatter, one.x[rows]):
        one.scatter = 0.0
    else:
        one.observe("scatter of the deformation", rows, one.scatter, "mm", "smoothed")


def _repeats(one: Run) -> None:
    """Leave out rows that repeat a reading of a logger faster than its gauges."""
    kept, rows = np.flatnonzero(one.kept), one.distinct()
    times = np.diff(np.searchsorted(kept, rows))
    if rows.size < FEWEST or np.median(times) < 2.0:
        return
    usual = float(np.median(times))
    if np.mean(np.abs(times - usual) <= 1.0) < _REGULAR:
        return
    repeated = np.setdiff1d(kept, rows)
    one.cut(repeated, REPEATED)
    one.observe("repeated reading", repeated, usual, "rows", "cut")


def _tare(one: Run) -> None:
    first, step, unit = rows_before_tare(one.x, one.y)
    if first:
        before = np.arange(first)
        one.cut(before, TARE)
        one.observe("before the tare", before, step, unit, "cut")


def _saturation(one: Run) -> None:
    rows = np.flatnonzero(one.kept)
    x, y = one.x[rows], one.y[rows]
    channels: tuple[tuple[Kind, str, np.ndarray, np.ndarray], ...] = (
        ("saturation of the force", "N", y, x),
        ("saturation of the deformation", "mm", x, y),
    )
    for kind, unit, held, moving in channels:
        found = saturated_rows(held, moving)
        if found.size:
            one.cut(rows[found], SATURATED)
            one.observe(kind, rows[found], float(held[found[0]]), unit, "cut")


def _scatter(one: Run) -> float:
    rows = one.distinct()
    return scatter_of_deformation(one.x[rows], one.y[rows])


def _wild(one: Run) -> None:
    rows = one.distinct()
    found, off = wild_readings(one.x[rows], one.y[rows])
    if not found.size or found.size > _MOST_WILD * rows.size:
        return
    wild = one.with_repeats(rows[found])
    one.cut(wild, WILD)
    largest = float(off[np.argmax(np.abs(off))])
    one.observe("wild reading", wild, largest, "N", "cut")


def _jumps(one: Run) -> bool:
    """Give the rows after each jump another zero, and tell whether there is a jump."""
    found: dict[int, Jump] = {}
    as_read = one.x.copy(), one.y.copy()
    for _ in range(2 * _MOST_JUMPS):
        rows = one.distinct()
        jump = find_jump(one.x[rows], one.y[rows], one.scatter)
        if jump is None:
            break
        row = int(rows[jump.row])
        one.x[row:] -= jump.deformation
        one.y[row:] -= jump.force
        # what is left of one that was found before
        found[row] = jump + found[row] if row in found else jump
    if len(found) > _MOST_JUMPS:
        one.x, one.y = as_read
        return False
    for row, jump in sorted(found.items()):
        one.zero[row:] += 1
        kind, unit = _JUMPS[jump.channel]
        size = jump.deformation if unit == "mm" else jump.force
        one.observe(kind, np.array([row]), size, unit, "new zero")
    return bool(found)
