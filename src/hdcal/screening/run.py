"""One run on its way through the screening."""

from dataclasses import dataclass, field

import numpy as np

from hdcal.screening.result import Action, Kind, Observation, stretches


@dataclass
class Run:
    """One run on its way through the screening; rows are those of the run.

    Attributes:
        index: index of the run.
        rows: its rows in the whole record, in order.
        segment: segment of each row.
        kept: which rows stay.
        zero: jumps before each row.
        plain: whether a straight line explains it.
        observations: so far.
    """

    index: int
    rows: np.ndarray
    x: np.ndarray
    y: np.ndarray
    segment: np.ndarray
    kept: np.ndarray
    zero: np.ndarray
    scatter: float = 0.0
    plain: bool = False
    observations: list[Observation] = field(default_factory=list)

    @classmethod
    def of(
        cls,
        rows: np.ndarray,
        x: np.ndarray,
        y: np.ndarray,
        index: int = 0,
    ) -> "Run":
        """Return some rows of a record, all of them kept.

        Args:
            rows: rows of the record, in order, shape (r,).
            x: deformation of the record, shape (n,).
            y: force of the record, shape (n,).
            index: index of the run.
        """
        segment, zero = np.zeros((2, rows.size), int)
        kept = np.ones(rows.size, bool)
        return cls(index, rows, x[rows], y[rows], segment, kept, zero)

    def observe(
        self, kind: Kind, rows: np.ndarray, size: float, unit: str, action: Action
    ) -> None:
        """Add an observation of some rows of the run."""
        where = stretches(self.rows[rows])
        found = Observation(kind, where, float(size), unit, action, self.index)
        self.observations.append(found)

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
        distinct = self.distinct()
        starts = np.searchsorted(distinct, rows)
        stops = np.r_[distinct, self.x.size][starts + 1]
        pairs = zip(rows, stops, strict=True)
        found = [np.arange(first, stop) for first, stop in pairs]
        whole = np.concatenate(found) if found else np.array([], int)
        return whole[self.kept[whole]]
