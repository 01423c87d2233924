"""The values that a reading in steps can have, and what they say of the force itself.

All else is computed before it is rounded: a limit of readings comes in as the force up
to which no reading exceeds it, and a bound goes out as the reading of that force.
"""

from dataclasses import dataclass, replace
from decimal import Decimal

import numpy as np

from hdcal.data.case import Case
from hdcal.prediction.engine.loading_sense import LoadingSense

# Readings are on one grid where most are no farther from it than this share of a step:
# a slip of the pen is not on it.
_OFF, _MOST = 0.1, 0.75
# Share of a step by which a reading may miss its grid for want of binary digits.
_EXACT = 1e-9
# So few readings may lie on a grid by chance.
_FEWEST = 8


@dataclass(frozen=True)
class ReadingGrid:
    """What readings are rounded to, along the sense of loading.

    Attributes:
        step: of the readings [N]; 0 where they have none.
        origin: any value on the grid [N]; None where readings lie on no one grid, so
            that a bound has to hold wherever it lies.
    """

    step: float
    origin: float | None

    def unrounded(self, limit: float) -> float:
        """Return the force [N] up to which no reading exceeds a limit [N].

        A limit that is a reading but for digits that were not written is that reading.
        """
        if self.step == 0.0 or self.origin is None:
            return limit - 0.5 * self.step
        _, _, last = Decimal(repr(float(limit))).as_tuple()
        unwritten = min(0.5 * 10.0 ** int(last), _OFF * self.step)
        steps = np.floor((limit - self.origin + unwritten) / self.step + _EXACT)
        return float(self.origin + self.step * (steps + 0.5))

    def upper(self, force: float) -> float:
        """Return the least reading that no smaller force exceeds [N]."""
        if self.step == 0.0 or self.origin is None:
            return force + 0.5 * self.step
        steps = np.ceil((force - self.origin) / self.step - 0.5)
        return float(self.origin + self.step * steps)

    def lower(self, force: float) -> float:
        """Return the largest reading below which no larger force is read [N]."""
        return -self.mirrored().upper(-force)

    def mirrored(self) -> "ReadingGrid":
        """Return the grid of the same readings along the other sense."""
        return replace(self, origin=None if self.origin is None else -self.origin)


def reading_grid(case: Case, sense: LoadingSense, *, rounded: bool) -> ReadingGrid:
    """Return what the readings of a case are rounded to.

    Args:
        case: with the resolution of its force.
        sense: of loading, along which the grid is.
        rounded: whether readings are asked for, and have steps.
    """
    if not rounded:
        return ReadingGrid(0.0, None)
    step, force = case.gear.force_resolution, np.asarray(case.records.force)
    centre = np.angle(np.exp(2j * np.pi * force / step).mean()) / (2.0 * np.pi)
    away = force / step - centre
    middle = np.median(away - np.round(away))
    off = np.abs(away - np.round(away) - middle)
    known = len(force) >= _FEWEST and np.mean(off <= _OFF) >= _MOST
    found = ReadingGrid(step, float((centre + middle) * step) if known else None)
    return found if sense > 0 else found.mirrored()
