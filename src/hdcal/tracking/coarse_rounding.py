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
        forget: share of what is known that is kept at each row, 1 = all. A count fades
            as the knowledge does.
    """

    def __init__(self, step: float, forget: float = 1.0):
        self._step, self._forget = step, forget
        # Readings of a cell, faded to the row of the last one, and which row that was.
        self._count: dict[int, tuple[float, int]] = {}
        self._rows = 0

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
        """Return what the next row adds, over what the first of its force said.

        So what is kept of all rows of a force is what their faded number says: a row
        says anew what has faded since.

        Args:
            expected: force before rounding [N].
            share: from `share`.
        """
        self._rows += 1
        if share == 0.0:
            return 1.0
        cell = round(expected / (_CELL * self._step))
        near = [self._count.get(cell + i, (0.0, self._rows)) for i in (-1, 0, 1)]
        before = sum(count * self._kept(row) for count, row in near)
        if cell in self._count or len(self._count) < _MOST_CELLS:
            count, row = near[1]
            self._count[cell] = count * self._kept(row) + 1.0, self._rows
        rest, after = 1.0 - share, before + 1.0
        said = after / (after * share + rest)
        if before > 0.0:
            kept = max(self._kept(row) for count, row in near if count)
            said -= before * kept / (before * share + rest * kept)
        return min(said, 1.0)

    def _kept(self, row: int) -> float:
        """Return the share that is kept of what was known at a row."""
        return self._forget ** (self._rows - row)
