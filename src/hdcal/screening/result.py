"""The result of a screening: what was found in a record, and what was done."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Kind = Literal[
    "before the tare",
    "jump of the force",
    "jump of the deformation",
    "jump of both",
    "wild reading",
    "opposite sign",
    "negative slope",
    "saturation of the force",
    "saturation of the deformation",
    "scatter of the deformation",
    "after the largest force",
    "outside the range",
    "repeated reading",
]
Action = Literal["cut", "new zero", "turned", "asked", "smoothed"]
# What a row belongs to; the order is that of `Screening.segment`.
SEGMENTS = (
    "loading",
    "unloading",
    "holding",
    "before the tare",
    "after the largest force",
    "wild reading",
    "saturated",
    "outside the range",
    "repeated reading",
)
# Words for people, where the key of a segment is another one.
SEGMENT_WORDS = {"wild reading": "outlier"}
LOADING, UNLOADING, HOLDING, TARE, DROPPED, WILD, SATURATED, OUTSIDE, REPEATED = range(
    len(SEGMENTS)
)
# Share by which stiffnesses differ at least: less matters to nobody, however well both
# are known.
LEAST_DIFFERENCE = 0.1
# A testing machine of class 0.5 may err by this share of the force (ISO 7500-1): a
# curve that bends by less is a straight line, and slopes that differ by less are one.
MACHINE_CLASS = 0.005
NORMAL_95 = 1.96  # half a 95 % interval of a normal distribution, in sds
# First and last row of each stretch of rows.
Stretches = tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Observation:
    """One finding in the record, and what was done about it."""

    kind: Kind
    rows: Stretches  # from 0
    size: float
    unit: str
    action: Action
    run: int = 0
    where: str = ""  # the rows as their file names them
    words: str = ""  # a sentence without a full stop
    gear: str = ""

    @property
    def count(self) -> int:
        """Number of rows."""
        return sum(last - first + 1 for first, last in self.rows)


@dataclass(frozen=True)
class StraightPart:
    """The longest straight part of the largest movement of a run."""

    low: float  # smallest and largest deformation, as read [mm]
    high: float
    rows: np.ndarray  # mask without rows of other branches, shape (n,)
    slope: float  # of the force over the deformation, by least squares [N/mm]
    slope_sd: float  # its standard error [N/mm]
    whole: bool  # whether every movement of the run is straight


@dataclass(frozen=True)
class Screening:
    """A record after screening; arrays have the shape (n,)."""

    observations: tuple[Observation, ...]
    segment: np.ndarray  # index into `SEGMENTS`
    kept: np.ndarray
    deformation: np.ndarray  # with each jump of its zero taken out [mm]
    force: np.ndarray  # likewise, turned where its sign was opposite [N]
    zero: np.ndarray  # number of jumps before each row in its run
    deformation_sd: float = 0.0  # scatter of the gauge [mm]; 0 where none shows
    trembling: bool = False  # the scatter hides the direction of the movement
    straight: StraightPart | None = None  # of a single run with rows enough
    working_range: str = ""  # in words; empty where none is stated
    straight_in_range: StraightPart | None = None  # of a range chosen by its ends

    @property
    def excluded(self) -> tuple[tuple[float, float], ...]:
        """Deformations [mm] beyond those that stayed; all of them after a drop."""
        x, found = self.deformation, []
        low, high = float(x[self.kept].min()), float(x[self.kept].max())
        for segment, without_end in ((DROPPED, True), (OUTSIDE, False)):
            left = x[self.segment == segment]
            if left.size and left.max() > high:
                found.append((high, np.inf if without_end else float(left.max())))
            if left.size and left.min() < low:
                found.append((-np.inf if without_end else float(left.min()), low))
        return tuple(found)

    @property
    def excluded_sense(self) -> int:
        """Sign of the movement of the branches that were left out; 0 where none was."""
        if self.deformation_sd:
            return 0
        x = self.deformation
        kept, left = x[self.kept], x[self.segment == OUTSIDE]
        between = (left > kept.min()) & (left < kept.max())
        return -int(np.sign(kept[-1] - kept[0])) if between.any() else 0

    @property
    def asked(self) -> tuple[Observation, ...]:
        """Findings that only the user can decide about."""
        return tuple(o for o in self.observations if o.action == "asked")


def stretches(rows: np.ndarray | Sequence[int]) -> Stretches:
    """Return first and last of each stretch of increasing rows without a gap."""
    rows = np.asarray(rows, int)
    if not rows.size:
        return ()
    cuts = np.flatnonzero(np.diff(rows) > 1)
    firsts, lasts = rows[np.r_[0, cuts + 1]], rows[np.r_[cuts, rows.size - 1]]
    return tuple(zip(firsts.tolist(), lasts.tolist(), strict=True))
