"""The gears of a posterior, each integrated on its own."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from hdcal.exported import jit
from hdcal.inference.distributions import sample_prior
from hdcal.inference.posterior import Posterior
from hdcal.inference.problem import Problem, case_reading
from hdcal.inference.values import Values
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.dynamic_priors import mass_prior
from hdcal.motion.respond.request import Request
from hdcal.physics.chain import Base, Reading
from hdcal.physics.dynamics import (
    Oscillator,
    Scalar,
    damping_ratio,
    integrate,
    natural_frequency,
)
from hdcal.physics.effect import Effect, parameters
from hdcal.prediction.engine.gear_forces import gear_bends, gear_leftover
from hdcal.prediction.engine.untested import Bends, Untested

# Draws integrated side by side: all wait for the slowest. With many times they are
# fewer, so that no more numbers than this are in memory at once.
_CHUNK, _MOST_STATES = 250, 1_000_000


class _Leftover(eqx.Module):
    """What the model leaves of the force of one draw, none at the unloaded gear."""

    problem: Problem
    value: Values
    bends: Bends
    unloaded: Scalar = 0.0

    def __call__(self, deformation: Scalar) -> Scalar:
        """Return it at a deformation as read from the unloaded gear [N]."""
        place = jnp.reshape(deformation, 1)
        # The damping of a leftover's loop is left out, which the page says.
        still = jnp.zeros(1)
        left = gear_leftover(self.problem, self.value, self.bends, place, still)
        return left[0] - self.unloaded


def unseen(posterior: Posterior, values: dict, mass, seed: int):
    """Return mass and damping ratio of each draw, from data or from their priors."""
    if isinstance(posterior, DynamicPosterior):
        return values["mass"], values["damping_ratio"]
    count, gear = len(values["K"]), posterior.case.gear
    rng = np.random.default_rng(seed)
    if mass is not None:
        moved = np.full(count, float(mass))
    else:
        radial = case_reading(posterior.case).radial_per_read
        moved = sample_prior(mass_prior(gear, radial), "mass", rng, count)
    ratio = gear.dynamic_priors["damping_ratio"]
    return moved, sample_prior(ratio, "damping_ratio", rng, count)


def _with_values(effect: type[Effect], values) -> Effect:
    own = {name: values[f"{effect.name}.{name}"] for name in parameters(effect)}
    return effect(**own)


@jit(static_argnames=("kept", "with_damping"))
def _each(
    values,
    reading,
    temperature,
    damping,
    force,
    times,
    reach,
    leftover,
    *,
    kept,
    with_damping,
):
    """Return motion, facts, whether each draw of a batch came through, or ran away."""

    def one(value):
        left = None
        if leftover is not None:
            problem, untested = leftover
            left = _Leftover(problem, value, gear_bends(untested, value))
            left = replace(left, unloaded=left(0.0))
        effects = tuple(_with_values(effect, value) for effect in kept)
        stiffness = value["stiffness"] / reading.radial_per_read
        base = Base(stiffness, value["alpha"], 0.0, 0.0, 1.0)
        mass = value["_mass"]
        still = Oscillator(mass, 0.0, base, effects, reading, temperature, left)
        k = still.stiffness
        c = damping if with_damping else 2.0 * value["_ratio"] * jnp.sqrt(k * mass)
        gear = replace(still, damping=c)
        states, done, gone = integrate(gear, force, times, reach)
        deformation = states[:, 0]
        facts = _facts(mass, c, k) | {"peak_mm": _largest(times, states)}
        return deformation, facts, done, gone

    return jax.vmap(one)(values)


def _computed(*given, **asked):
    """Return it when it is there: who waits for a promise of JAX hears nothing."""
    return jax.device_get(_each(*given, **asked))


def _largest(times, states):
    """Return the largest size of the deformation, also between the times [mm].

    Between two of them it is the cubic of their deformations and speeds.
    """
    (y, other), step = (states[:-1, 0], states[1:, 0]), jnp.diff(times)
    begin, end = step * states[:-1, 1], step * states[1:, 1]
    square = 3.0 * (other - y) - 2.0 * begin - end
    cube = begin + end - 2.0 * (other - y)
    # Where its slope, begin + 2 square s + 3 cube s², is zero.
    root = jnp.sqrt(jnp.maximum(square**2 - 3.0 * cube * begin, 0.0))
    common = -(square + jnp.where(square < 0.0, -root, root))
    turns = []
    for above, below in ((common, 3.0 * cube), (begin, common)):
        share = above / jnp.where(below == 0.0, 1.0, below)
        turns.append(jnp.clip(share, 0.0, 1.0))
    inner = [y + s * (begin + s * (square + s * cube)) for s in turns]
    return jnp.max(jnp.abs(jnp.concatenate([states[:, 0], *inner])))


def _facts(mass, damping, stiffness) -> dict[str, Any]:
    frequency = natural_frequency(mass, stiffness)
    ratio = damping_ratio(mass, damping, stiffness)
    return {
        "mass_kg": 1e3 * mass,
        "damping_N_s_per_mm": damping + 0.0 * mass,
        "damping_ratio": ratio,
        "stiffness_N_per_mm": stiffness,
        "natural_frequency_Hz": frequency,
        "damped_frequency_Hz": frequency * jnp.sqrt(jnp.maximum(1.0 - ratio**2, 0.0)),
    }


def integrate_all(
    kept,
    reading: Reading,
    values: dict,
    temperature: float,
    damping,
    request: Request,
    reach: float,
    leftover: tuple[Problem, Untested] | None,
):
    """Integrate every draw.

    Args:
        kept: effects taken along.
        reading: how the rig reads.
        values: of the draws, with `_mass` and `_ratio`.
        temperature: of the gear [°C].
        damping: given [N·s/mm], or None for that of the ratio.
        request: force and times.
        reach: deformation beyond which no gear of this size is followed [mm].
        leftover: structure and what is untested, whose sites the draws then hold; None
            where the force at rest was not calibrated.

    Returns:
        Deformation (draw, time), facts by name (draw,), which draws came through, and
        which ones ran away.
    """
    size = max(min(_CHUNK, _MOST_STATES // len(request.times)), 1)
    count = len(values["K"])
    motion, parts = np.empty((count, len(request.times))), []
    given = 0.0 if damping is None else float(damping)
    about = reading, temperature, given, request.force, request.times, reach, leftover
    asked = {"kept": kept, "with_damping": damping is not None}
    # An interruption is heard while a batch, which may take minutes, goes on.
    pool = ThreadPoolExecutor(1)
    try:
        for start in range(0, count, size):
            chunk = {name: v[start : start + size] for name, v in values.items()}
            moved, *part = pool.submit(_computed, chunk, *about, **asked).result()
            motion[start : start + size] = moved
            parts.append(part)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    facts = {n: np.concatenate([p[0][n] for p in parts]) for n in parts[0][0]}
    done, gone = (np.concatenate([part[place] for part in parts]) for place in (1, 2))
    return motion, facts, done, gone
