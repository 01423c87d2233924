"""What a rig does row by row, before any force is read."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
FULL = 0.54  # largest deformation of the rigs' own loadings [mm]


@dataclass(frozen=True)
class History:
    """Rows in the order they are taken; every array has shape (n,).

    Attributes:
        deformation: set on the table [mm].
        temperature: of the specimen [°C].
        time: since the start of the run [s].
        angle: of the specimen under the load [rad].
        direction: +1 loading, 0 holding, -1 unloading.
        sense: of the last movement, +1 or -1.
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
        """Temperature above the record's mean [K]."""
        return self.temperature - np.mean(self.temperature)

    @property
    def relative_deformation(self) -> Floats:
        """Deformation as a share of the record's largest."""
        return self.deformation / np.max(self.deformation)

    @property
    def run_starts(self) -> Flags:
        """True where a run begins."""
        return np.diff(self.run, prepend=self.run[0] - 1) != 0

    @property
    def half_cycle(self) -> NDArray[np.int64]:
        """Number of the half cycle over the whole record, from 0."""
        turns = np.diff(self.sense, prepend=self.sense[0]) != 0
        return np.cumsum(turns | self.run_starts) - 1

    @property
    def steps(self) -> Floats:
        """Seconds since the row before, none across a change of run."""
        return np.where(self.run_starts, 0.0, np.diff(self.time, prepend=0.0))

    @property
    def travel(self) -> Floats:
        """Way that the drive has gone since the start, both ways [mm]."""
        return np.cumsum(np.abs(np.diff(self.deformation, prepend=0.0)))

    @property
    def run_length(self) -> float:
        """Duration of the longest run [s]; one where the clock stands still."""
        longest = float(np.max(self.time) - np.min(self.time))
        return longest if longest > 0.0 else 1.0


def last_true(rows: Flags) -> NDArray[np.int64]:
    """Return, for each row, the last one up to it that is true; 0 before any."""
    return np.maximum.accumulate(np.where(rows, np.arange(len(rows)), 0))
