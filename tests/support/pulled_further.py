"""Virtual rigs that were tested on a part of the stroke, and the truth along it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from benchmarks.blind.rig.history import FULL
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.virtual_rig import draw_rig
from benchmarks.bounds import ramp

# Largest tested deformation [mm]; where the truth is known, in multiples of it.
TESTED = FULL / 2.0
TIMES = (0.5, 0.9, 1.0, 1.0001, 1.02, 1.1, 1.2, 1.5, 2.0)


@dataclass(frozen=True)
class PulledFurther:
    """A ramp, and the reading without noise at multiples of its end.

    Attributes:
        deformation: measured rows [mm].
        force: of these rows, with noise [N].
        at: places inside and beyond [mm].
        truth: reading there without noise [N].
    """

    deformation: np.ndarray
    force: np.ndarray
    at: np.ndarray
    truth: np.ndarray


def pulled_further(
    name: str, r: float, rng: np.random.Generator, rows: int = 30
) -> PulledFurther | None:
    """Return a ramp on which a mechanism leaves a gap of r noise sds.

    Args:
        name: of the mechanism.
        r: RMS of the gap over the noise in the measured rows.
        rng: draws rig, shape and noise.
        rows: that were measured.

    Returns:
        None where no plausible size reaches r.
    """
    measured, at = np.linspace(0.02, TESTED, rows), TESTED * np.array(TIMES)
    path = np.union1d(measured, at)
    rig = draw_rig(ramp(path), rng)
    tested = np.isin(path, measured)
    active = rig.draw_mechanism(MECHANISMS[name], r, rng, tested)
    if active is None:
        return None
    full = rig.readings([active])
    force = full[tested] + rig.sigma * rng.normal(size=rows)
    return PulledFurther(measured, force, at, full[np.searchsorted(path, at)])


def all_pulled_further(names, count: int, seed: int) -> Iterator[PulledFurther]:
    """Yield ramps of mechanisms at gaps of one and two noise sds."""
    rng = np.random.default_rng(seed)
    for name in names:
        for r in (1.0, 2.0):
            for _ in range(count):
                if (found := pulled_further(name, r, rng)) is not None:
                    yield found
