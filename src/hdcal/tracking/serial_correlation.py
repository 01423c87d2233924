"""Noise that is correlated from reading to reading, estimated and taken out of rows.

With noise e_t = ρ e_(t−1) + √(1−ρ²) u_t the rows

    (y_t − ρ y_(t−1), x_t − ρ x_(t−1)) / √(1−ρ²)

have independent noise of the same variance (Cochrane and Orcutt, 1949). A core that
learns these rows gives the least-squares answer of correlated readings.
"""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

# Sds of chance that an estimate has to lie from zero before it is believed, so that
# independent readings mostly stay as they are; it then counts as one sd larger,
# because too small a one means too many false alarms.
_BELIEVED, _CAREFUL = 2.5, 1.0
# Fewer pairs of readings say too little. Until then scores count for the alarm as if
# their correlation were this: the sums of a larger one would call far too often.
_FEWEST, _UNSEEN = 30, 0.6
# Largest correlation in size: nearer to one a zero could not be told from its noise.
_MOST = 0.95
# A step of time over so many usual ones is a pause, over which noise forgets; a usual
# one is a mean over about so many rows.
_PAUSE, _USUAL = 10.0, 20
# A glitch beyond so many half-widths counts as one of this size.
_FARTHEST = 2.0


@dataclass(frozen=True)
class WhiteRow:
    """A row whose noise is independent of the row before.

    Attributes:
        columns: of the linear coefficients.
        force: what the core is to learn [N].
        carried: what the row before says of the reading, beside the columns [N].
        scale: reading = carried + scale · force.
    """

    columns: np.ndarray
    force: float
    carried: float
    scale: float


class SerialCorrelation:
    """The lag-one correlation ρ of the readings' noise, from standardised errors.

    Attributes:
        value: ρ that is taken out of rows, 0 until there is evidence of any.
    """

    def __init__(self):
        self.value = 0.0
        self._pairs = 0
        self._power = self._product = 0.0
        self._row: tuple[np.ndarray, float] | None = None
        self._error: float | None = None
        self._time: float | None = None
        self._usual = inf

    @property
    def weight(self) -> float:
        """Share of a score that counts for the alarm: less before ρ can be seen."""
        seen = self._pairs >= _FEWEST
        return 1.0 if seen else sqrt((1.0 - _UNSEEN) / (1.0 + _UNSEEN))

    def restart(self) -> None:
        """Begin anew with the next row, as on another mounting; ρ is kept."""
        self._row = self._error = None

    def follow(self, time: float | None) -> None:
        """Begin anew after a pause, or where time goes back.

        Args:
            time: of the next row [s], if it has one.
        """
        if time is None:
            return
        before, self._time = self._time, time
        if before is None:
            return
        step = time - before
        if not 0.0 <= step <= _PAUSE * self._usual:
            self.restart()
        if 0.0 < step < self._usual / _PAUSE:
            # What was taken for usual was a pause.
            self._usual = step
        elif step > 0.0:
            self._usual += (min(step, _PAUSE * self._usual) - self._usual) / _USUAL

    def whiten(self, columns: np.ndarray, force: float) -> WhiteRow:
        """Return a row freed of what the row before says of its noise.

        Args:
            columns: of the linear coefficients, any shape.
            force: reading [N].
        """
        before, self._row = self._row, (columns, force)
        if before is None or self.value == 0.0:
            return WhiteRow(columns, force, 0.0, 1.0)
        rho, scale = self.value, sqrt(1.0 - self.value**2)
        carried = rho * before[1]
        rest = (columns - rho * before[0]) / scale
        return WhiteRow(rest, (force - carried) / scale, carried, scale)

    def learn(self, error: float) -> None:
        """Take the error of a row against the coefficients known before it.

        Args:
            error: reading less expected force, in half-widths of its 95 % interval.
        """
        error = min(max(error, -_FARTHEST), _FARTHEST)
        before, self._error = self._error, error
        if before is None:
            return
        self._pairs += 1
        self._product += error * before
        self._power += 0.5 * (error**2 + before**2)
        found = self._product / self._power if self._power > 0.0 else 0.0
        chance = sqrt((1.0 - min(found**2, 1.0)) / self._pairs)
        believed = abs(found) * sqrt(self._pairs) > _BELIEVED
        believed = believed and self._pairs >= _FEWEST
        found += _CAREFUL * chance
        self.value = min(max(found, -_MOST), _MOST) if believed else 0.0
