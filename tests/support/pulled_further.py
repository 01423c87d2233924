"""Virtual rigs of which a part of the stroke was measured, and the truth beyond it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from benchmarks.blind.rig.history import FULL, History
from benchmarks.blind.rig.mechanisms import MECHANISMS
from benchmarks.blind.rig.virtual_rig import draw_rig

# A prediction is an immediate reading: what time alone brings is no part of it.
OF_TIME = ("charge_leakage", "amplifier_drift")


@dataclass(frozen=True)
class PulledFurther:
    """A ramp, and the reading without noise where it was not measured.

    Attributes:
        deformation: measured rows [mm].
        force: likewise, with noise [N].
        at: beyond them [mm].
        truth: reading there without noise [N].
        zero: what is read without a load; the rest of a reading is the gear's [N].
    """

    deformation: np.ndarray
    force: np.ndarray
    at: float
    truth: float
    zero: float


def _ramp(deformation) -> History:
    count = len(deformation)
    none, one = np.zeros(count, dtype=int), np.ones(count)
    return History(
        deformation=deformation,
        temperature=20.0 * one,
        time=2.0 * np.arange(count),
        angle=np.linspace(0.0, 2.0 * np.pi, count),
        direction=one,
        sense=one,
        cycle=none,
        run=none,
        specimen=none,
        force=0.0 * one,
    )


def pulled_further(
    name: str, r: float, times: float, rng: np.random.Generator, rows: int = 30
) -> PulledFurther | None:
    """Return a ramp on which a mechanism leaves a gap of r noise sds.

    Args:
        name: of the mechanism.
        r: RMS of the gap over the noise in the measured rows.
        times: the deformation asked for, over the largest measured.
        rng: draws rig, shape and noise.
        rows: that were measured.

    Returns:
        None where no plausible size reaches r.
    """
    measured = np.linspace(0.02, FULL / times, rows)
    on = np.linspace(FULL / times, FULL, 20)[1:]
    rig = draw_rig(_ramp(np.concatenate([measured, on])), rng)
    active = rig.draw_mechanism(MECHANISMS[name], r, rng, slice(rows))
    if active is None:
        return None
    full = rig.readings([active])
    noise = rig.sigma * rng.normal(size=rows)
    told = measured, full[:rows] + noise, FULL, float(full[-1]), rig.zero
    return PulledFurther(*told)


def all_pulled_further(
    names, times: float, count: int, seed: int
) -> Iterator[PulledFurther]:
    """Yield ramps of mechanisms at gaps of one and two noise sds."""
    rng = np.random.default_rng(seed)
    for name in names:
        for r in (1.0, 2.0):
            for _ in range(count):
                if (found := pulled_further(name, r, times, rng)) is not None:
                    yield found
