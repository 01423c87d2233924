"""The motions of many draws of a gear under one force."""

from concurrent.futures import ThreadPoolExecutor

import jax
import numpy as np

from hdcal.errors import NotUsable
from hdcal.exported import jit
from hdcal.inference.force_model.problem import case_reading
from hdcal.motion.drive import Drive
from hdcal.motion.gear_force import CalibratedGears, leftover_force
from hdcal.physics.chain import Base
from hdcal.physics.dynamics import Oscillator, acting, integrate
from hdcal.physics.effect import parameters

# Draws that are integrated together, and the largest number of their states.
_CHUNK, _MOST_STATES = 250, 1_000_000


def integrate_all(
    gears: CalibratedGears, drive: Drive, temperature: float, values, mass, damping
) -> tuple[np.ndarray, np.ndarray]:
    """Return the deformation of every draw, (draw, n), and its largest size [mm].

    Args:
        gears: what was calibrated.
        drive: force and times.
        temperature: of the gear [°C].
        values: draws of the calibration, [draw, …].
        mass: of each draw [N·s²/mm].
        damping: of each draw [N·s/mm].

    Raises:
        NotUsable: some motions do not come to their end.
    """
    case, (kept, _) = gears.posterior.case, acting(gears.effects)
    about = case_reading(case), temperature, drive.force, drive.times, case.gear.reach
    count, times, draws = len(mass), len(drive.times), (values, mass, damping)
    size = max(min(_CHUNK, _MOST_STATES // times), 1)
    motion, peak = np.empty((count, times)), np.empty(count)
    done, gone = np.empty(count, bool), np.empty(count, bool)
    # A computation of JAX does not react to an interruption: it runs in a thread.
    pool = ThreadPoolExecutor(1)
    try:
        for first in range(0, count, size):
            rows = slice(first, first + size)
            part = jax.tree.map(lambda each, rows=rows: each[rows], draws)
            moved = pool.submit(_computed, part, *about, kept=kept).result()
            motion[rows], peak[rows], done[rows], gone[rows] = moved
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    if gone.any():
        words = f"{np.count_nonzero(gone)} of {count} gears give way under this force"
        remedy = "ask for a smaller amplitude, or measure that far, pulled and pushed"
        raise NotUsable(f"{words}, up to {case.gear.reach:g} mm: {remedy}")
    if not done.all():
        words = f"{np.count_nonzero(~done)} of {count} motions could not be integrated"
        raise NotUsable(f"{words}: ask for a shorter duration")
    return motion, peak


def _computed(*given, kept):
    return jax.device_get(_moved(*given, kept=kept))


@jit(static_argnames=("kept",))
def _moved(draws, reading, at, force, times, reach, *, kept):
    """Return deformation, peak and outcome of each draw."""

    def one(draw):
        value, mass, damping = draw
        effects = tuple(
            effect(**{n: value[f"{effect.name}.{n}"] for n in parameters(effect)})
            for effect in kept
        )
        stiffness = value["stiffness"] / reading.radial_per_read
        base = Base(stiffness, value["alpha"], 0.0, 0.0, 1.0)
        leftover = leftover_force(value)
        gear = Oscillator(mass, damping, base, effects, reading, at, leftover)
        motion = integrate(gear, force, times, reach)
        return motion.deformation, motion.largest, motion.done, motion.gone

    return jax.vmap(one)(draws)
