"""Simulated gears as sums over their mountings, without files and screening."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

import hdcal
from hdcal.fleets.reading.readings import (
    FleetReadings,
    RowSums,
    reading_vectors,
    readings_of,
)

UP = np.linspace(0.05, 0.5, 8)
X, SENSE = np.concatenate([UP, UP[::-1]]), np.repeat([1.0, -1.0], len(UP))
RUNS = 2


def bend_shape() -> np.ndarray:
    """Return x|x| beside a straight line, with a bend of 1 N."""
    about, curve = X - X.mean(), X * np.abs(X)
    curve = curve - curve.mean()
    curve -= about * (about @ curve) / (about @ about)
    return curve / (min(12.0 * np.var(X), X.max() ** 2) / 4.0)


@dataclass
class GearRows:
    """Gears with a straight line, a zero for each mounting, a loop and a bend.

    Shapes: (gears,), zero and gain (gears, RUNS).
    """

    stiffness: np.ndarray
    zero: np.ndarray
    noise: np.ndarray
    loop: np.ndarray
    bend: np.ndarray
    gain: np.ndarray | float = 0.0
    labels: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def readings(self, rng: np.random.Generator) -> FleetReadings:
        """Return what is read on a rig."""
        gears = len(self.stiffness)
        gear = np.repeat(np.arange(gears), RUNS)
        gain = np.broadcast_to(self.gain, (gears, RUNS)).ravel()
        force = (
            (self.stiffness[gear] * (1.0 + gain))[:, None] * X
            + self.zero.ravel()[:, None]
            + 0.5 * self.loop[gear][:, None] * SENSE
            + self.bend[gear][:, None] * bend_shape()
            + self.noise[gear][:, None] * rng.standard_normal((len(gear), len(X)))
        )
        index = np.repeat(np.arange(len(gear)), len(X))
        many = np.tile(X, len(gear)), np.tile(SENSE, len(gear))
        sums = RowSums.of(index, reading_vectors(*many, force.ravel()), many[0])
        mountings = np.arange(len(gear))
        case = replace(
            _CASE,
            specimen_labels=tuple(f"G{g}" for g in range(gears)),
            run_labels=tuple(map(str, mountings)),
            **{name: tuple(labels) for name, labels in self.labels.items()},
        )
        return readings_of(case, gear, mountings, sums)


def ordinary(gears: int, rng: np.random.Generator) -> GearRows:
    """Return gears that scatter by 2 %, with zeros, noise and loops that scatter."""
    return GearRows(
        stiffness=200.0 * (1.0 + 0.02 * rng.standard_normal(gears)),
        zero=0.4 + 0.8 * rng.standard_normal((gears, RUNS)),
        noise=0.3 * np.exp(0.1 * rng.standard_normal(gears)),
        loop=1.0 + 0.1 * rng.standard_normal(gears),
        bend=0.5 + 0.1 * rng.standard_normal(gears),
    )


_ROWS = {"deformation_mm": X, "force_N": 200.0 * X + 0.3 * np.sin(37.0 * X)}
_CASE = hdcal.read_case(_ROWS)
