"""Readings rounded so coarsely that a repeated one says nothing new.

With noise of sd σ below half of the step q the error of rounding is much the same each
time a force is read: an error b of its own for each force, of variance

    q²/12 · exp(−4π² σ²/q²)

(the first harmonic of the error; exact without noise). k readings of one force then
say as much as one of variance b² + s²/k, where b² + s² is the variance of a reading.
"""

from math import exp, pi

# Forces in neighbouring cells, so many steps wide, share their error of rounding: what
# is expected of a force moves a little while the stiffness is learned.
_CELL = 0.125
# Forces that are told apart, to bound the memory; others count as new.
_MOST_CELLS = 4096
# A smaller share of the variance is no matter.
_LEAST_SHARE = 1e-3


class CoarseRounding:
    """How much each reading still says, by how often its force was read before.

    Args:
        step: of the force as read [N], 0 = not rounded.
    """

    def __init__(self, step: float):
        self._step = step
        self._count: dict[int, int] = {}

    def restart(self) -> None:
        """Begin anew, as on another mounting, where forces have another zero."""
        self._count.clear()

    def share(self, variance: float) -> float:
        """Return the share of a reading's variance that repeats with the force.

        Args:
            variance: of a reading, rounding included [N²].
        """
        if self._step == 0.0:
            return 0.0
        square = self._step**2
        noise = max(variance - square / 12.0, 0.0)
        found = square / 12.0 * exp(-4.0 * pi**2 * noise / square) / variance
        return min(found, 1.0) if found > _LEAST_SHARE else 0.0

    def weight(self, expected: float, share: float) -> float:
        """Return what a reading adds, as a share of what the first of its force said.

        Args:
            expected: force before rounding [N].
            share: from `share`.
        """
        if share == 0.0:
            return 1.0
        cell = round(expected / (_CELL * self._step))
        before = sum(self._count.get(near, 0) for near in range(cell - 1, cell + 2))
        if cell in self._count or len(self._count) < _MOST_CELLS:
            self._count[cell] = self._count.get(cell, 0) + 1
        rest = 1.0 - share
        after = before + 1
        return after / (after * share + rest) - before / (max(before, 1) * share + rest)
