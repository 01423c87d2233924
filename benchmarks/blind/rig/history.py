"""The movement of a rig row by row, before any force is read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
FULL = 0.54  # largest deformation of the loadings [mm]


@dataclass(frozen=True)
class History:
    """Rows in the order they are taken; every array has shape (n,).

    Attributes:
        deformation: set on the table [mm].
        temperature: of the specimen [°C].
        time: since the start of the run [s].
        angle: of the specimen under the load [rad].
        direction: +1 loading, 0 holding, -1 unloading.
        sense: direction of the last movement, +1 or -1.
        cycle: number of the load and unload over the whole record, from 0.
        run: number of the mounting, from 0.
        specimen: number of the gear, from 0.
        force: of the gear itself [N]; zero before anything is simulated.
    """

    deformation: Floats
    temperature: Floats
    time: Floats
    angle: Floats
    direction: Floats
    sense: Floats
    cycle: NDArray[np.int64]
    run: NDArray[np.int64]
    specimen: NDArray[np.int64]
    force: Floats

    @property
    def order(self) -> NDArray[np.int64]:
        """Number of each row, from 0."""
        return np.arange(len(self.deformation))

    @property
    def rise(self) -> Floats:
        """Temperature above the reference of 20 °C [K]."""
        return self.temperature - 20.0

    @property
    def warmer(self) -> Floats:
        """Temperature above the mean of the record [K]."""
        return self.temperature - np.mean(self.temperature)

    @property
    def relative_deformation(self) -> Floats:
        """Deformation over the largest of the record."""
        return self.deformation / np.max(self.deformation)

    @property
    def relative_force(self) -> Floats:
        """Force of the gear over the largest of the record."""
        return to_one(self.force)

    @property
    def run_starts(self) -> Flags:
        """True in the first row of each run."""
        return np.diff(self.run, prepend=self.run[0] - 1) != 0

    @property
    def half_cycle(self) -> NDArray[np.int64]:
        """Number of the half cycle over the whole record, from 0."""
        turns = np.diff(self.sense, prepend=self.sense[0]) != 0
        return np.cumsum(turns | self.run_starts) - 1

    @property
    def turns(self) -> Flags:
        """True in the first row of each half cycle."""
        return np.diff(self.half_cycle, prepend=-1) != 0

    @property
    def steps(self) -> Floats:
        """Seconds since the previous row of the run, 0 in its first row."""
        return np.where(self.run_starts, 0.0, np.diff(self.time, prepend=0.0))

    @property
    def travel(self) -> Floats:
        """Distance that the drive has moved since the start, both ways [mm]."""
        return np.cumsum(np.abs(np.diff(self.deformation, prepend=0.0)))

    @property
    def run_length(self) -> float:
        """Duration of the longest run [s]; 1 where no time passes."""
        longest = float(np.max(self.time) - np.min(self.time))
        return longest if longest > 0.0 else 1.0


def last_true(rows: Flags) -> NDArray[np.int64]:
    """Return, for each row, the last true one up to it; 0 before any."""
    return np.maximum.accumulate(np.where(rows, np.arange(len(rows)), 0))


def to_one(curve: Floats) -> Floats:
    """Scale to a largest size of one; a curve of zeros stays as it is."""
    return curve / max(float(np.max(np.abs(curve))), 1e-9)


def drawn_place(
    history: History, rng: np.random.Generator, low: float, high: float
) -> float:
    """Draw a deformation [mm] between two shares of the stroke."""
    return float(np.max(history.deformation)) * rng.uniform(low, high)


def bell(history: History, place: float, width: float) -> Floats:
    """A Gaussian bell over the deformation, place and width in mm."""
    return np.exp(-0.5 * ((history.deformation - place) / width) ** 2)


def beyond(history: History, place: float | Floats) -> Floats:
    """Deformation beyond a place, per tenth of a millimetre."""
    return np.maximum(history.deformation - place, 0.0) / 0.1


def followed(target: Floats, constant: float, history: History) -> Floats:
    """First-order lag behind a target with a time constant [s], still between runs."""
    kept, state = np.exp(-history.steps / constant), target.copy()
    for row in range(1, len(state)):
        state[row] = target[row] + (state[row - 1] - target[row]) * kept[row]
    return state


def latched(level: Floats, up: float, down: float, starts: Flags) -> Flags:
    """Switch on above one level and off below a lower one, else stay."""
    return level[last_true((level > up) | (level < down) | starts)] > up


def swing(turns: Floats, rising: float | Floats) -> Floats:
    """A triangle wave from -1 to 1 that rises during a share of each turn."""
    part = turns % 1.0
    return np.where(
        part < rising, 2 * part / rising - 1, 1 - 2 * (part - rising) / (1 - rising)
    )
