"""The motions of many draws of a calibrated gear under one force."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from scipy.interpolate import CubicSpline

from hdcal.errors import NotUsable
from hdcal.inference.force_model.priors import without_scatter
from hdcal.inference.force_model.problem import case_reading
from hdcal.inference.force_model.values import MEMBERS, Values
from hdcal.physics.chain import Base
from hdcal.physics.dynamics import Forcing, Oscillator, integrate
from hdcal.physics.effect import parameters
from hdcal.physics.theory import Scalar
from hdcal.prediction.joint import JointModel
from hdcal.prediction.simulate import gear_discrepancy

# The discrepancy of a draw at so many places, up to this multiple of the largest tested
# deformation either way. A cubic spline between them keeps the integration smooth.
_PLACES, _REACH = 121, 3.0
# Sites of a draw: the ends of the spline [mm], and its coefficients, highest first.
_ENDS, _DISCREPANCY = "_discrepancy_ends", "_discrepancy"
# Draws that are integrated together, and the largest number of their states.
_CHUNK, _MOST_STATES = 250, 1_000_000


def moving_draws(gears: JointModel, seed: int) -> dict[str, np.ndarray]:
    """Return the draws of one gear, of one calibrated at rest with its discrepancy."""
    # Values of tested members may be many, and are no part of a gear in motion.
    values = {n: v for n, v in gears.draws.items() if n not in MEMBERS.values()}
    if gears.posterior.kind == "dynamic":
        return values
    far = _REACH * float(np.max(np.abs(gears.posterior.case.records.deformation)))
    places = np.linspace(-far, far, _PLACES)
    spline = CubicSpline(places, gear_discrepancy(gears, places, seed=seed), axis=1)
    ends = np.tile(places[[0, -1]], (gears.size, 1))
    return values | {_ENDS: ends, _DISCREPANCY: np.moveaxis(spline.c, 2, 0)}


def _discrepancy_force(value: Values) -> Callable[[Scalar], Scalar] | None:
    """Return the force of one draw outside base and effects, zero when unloaded [N]."""
    if _DISCREPANCY not in value:
        return None

    def discrepancy(deformation: Scalar) -> Scalar:
        low, high = value[_ENDS]
        width = (high - low) / (_PLACES - 1)
        place = jnp.clip(deformation, low, high) - low
        part = jnp.clip(jnp.floor(place / width), 0, _PLACES - 2).astype(int)
        return jnp.polyval(value[_DISCREPANCY][:, part], place - part * width)

    unloaded = discrepancy(0.0)
    return lambda deformation: discrepancy(deformation) - unloaded


def integrate_all(
    gears: JointModel,
    values: Values,
    mass,
    damping,
    *,
    force: Forcing,
    times,
    temperature: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the deformation of every draw, (draw, n), and its largest size [mm].

    Raises:
        NotUsable: a gear gives way, or a motion could not be integrated.
    """
    effects, case = without_scatter(gears.effects), gears.posterior.case
    kept = tuple(effect for effect in effects if effect.instantaneous)
    settings = case_reading(case), temperature, force, times, case.gear.reach
    count, draws = len(mass), (values, mass, damping)
    size = max(min(_CHUNK, _MOST_STATES // len(times)), 1)
    motion, ends = np.empty((count, len(times))), []
    for first in range(0, count, size):
        rows = slice(first, first + size)
        part = jax.tree.map(lambda values, rows=rows: values[rows], draws)
        motion[rows], *end = jax.device_get(_moved(part, *settings, kept=kept))
        ends.append(end)
    peak, done, gone = map(np.concatenate, zip(*ends, strict=True))
    if gone.any():
        words = f"the deformation of {np.count_nonzero(gone)} of {count} draws exceeds"
        remedy = "use a smaller amplitude, or test larger deformations of both signs"
        raise NotUsable(f"{words} {case.gear.reach:g} mm: {remedy}")
    if not done.all():
        words = f"{np.count_nonzero(~done)} of {count} motions could not be integrated"
        raise NotUsable(f"{words}: use a shorter duration")
    return motion, peak


@jax.jit(static_argnames=("kept",))
def _moved(draws, reading, at, force, times, reach, *, kept):
    """Return deformation, peak and outcome of each draw."""

    def of_draw(draw):
        value, mass, damping = draw
        effects = tuple(
            effect(**{n: value[f"{effect.name}.{n}"] for n in parameters(effect)})
            for effect in kept
        )
        stiffness = value["stiffness"] / reading.radial_per_read
        base = Base(stiffness, value["alpha"], 0.0, 0.0, 1.0)
        discrepancy = _discrepancy_force(value)
        gear = Oscillator(mass, damping, base, effects, reading, at, discrepancy)
        motion = integrate(gear, force, times, reach)
        return motion.deformation, motion.largest, motion.done, motion.gone

    return jax.vmap(of_draw)(draws)
