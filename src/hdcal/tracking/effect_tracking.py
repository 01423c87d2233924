"""A posterior with effects as particles, if its effects can be followed row by row."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, InputError
from hdcal.exported import jit
from hdcal.inference.values import build_effects
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect
from hdcal.physics.effects.noise import HeteroscedasticNoise
from hdcal.prediction.engine.forces import grid_records
from hdcal.prediction.engine.pooled import Pooled
from hdcal.tracking.particles import Particles
from hdcal.tracking.stream_prior import StreamPrior

PARTICLES = 256
# What a line of the stream can carry beside deformation and force.
_CARRIED = frozenset({"temperature", "time"})
_SAME = 1e-9
# α, ω₀ and effects of each particle, every leaf (particle,).
Draws = tuple[Any, Any, tuple[Effect, ...]]


def build_particles(
    known: Pooled, prior: StreamPrior, forget: float
) -> tuple[Particles, Callable[[float, float, float], np.ndarray]]:
    """Return particles of a posterior with effects, and what they make of a row.

    Args:
        known: draws of all causes.
        prior: of the stream, from the same posterior.
        forget: has to be 1.

    Returns:
        The particles, and (deformation, temperature rise, time) → their columns but
        those of a fitted leftover.

    Raises:
        InputError: an effect remembers earlier rows, needs what a stream does not
            carry, shapes the noise, or is not linear in the stiffness.
    """
    findings = unfollowed(known, prior)
    if forget < 1.0:
        words = "does not go with effects"
        findings.append(Finding("forget", words, "Leave it out"))
    if findings:
        raise InputError(findings)
    chosen = _particle_draws(known)
    draws = _draws(known, chosen)
    # As arrays once, not at every row.
    reading = jax.tree.map(jnp.asarray, prior.reading)
    ends = jnp.array([0.8, 1.2]) * float(np.mean(np.asarray(prior.base.stiffness)))

    def columns(deformation: float, rise: float, time: float) -> np.ndarray:
        row = np.array([deformation, rise, time])
        return np.asarray(_columns(draws, reading, ends, row)).T

    return _particles(known, prior, chosen), columns


def force_effects(known: Pooled) -> list[type[Effect]]:
    """Return the effects that have to be followed.

    Noise that grows with the force only weighs the rows, see `UnequalRows`.
    """
    effects = known.problem.effects
    return [effect for effect in effects if effect is not HeteroscedasticNoise]


def unfollowed(known: Pooled, prior: StreamPrior) -> list[Finding]:
    """Return which effects of a posterior cannot be followed row by row.

    Args:
        known: draws of all causes.
        prior: of the stream, from the same posterior.
    """
    few, findings = _particle_draws(known)[::16], []
    for effect in force_effects(known):
        words = _undeclared(effect) or _tried(effect, known, prior, few)
        if words:
            remedy = "Calibrate without it, or diagnose blocks of rows"
            problem = f"its effect '{effect.name}' {words}"
            findings.append(Finding("known", problem, remedy))
    return findings


def _particle_draws(known: Pooled) -> np.ndarray:
    return np.linspace(0, len(known.values["K"]) - 1, PARTICLES).astype(int)


def _undeclared(effect: type[Effect]) -> str | None:
    """Say why an effect cannot be followed, as far as it declares it."""
    if effect.stage == "noise":
        return "shapes the noise, which is taken as normal"
    lacking = sorted(effect.needs - _CARRIED)
    return f"needs {', '.join(lacking)}, which a stream lacks" if lacking else None


def _tried(effect: type[Effect], known, prior, chosen) -> str | None:
    """Try whether a row's force depends on other rows, or bends in the stiffness.

    The trial goes far beyond the tested range, so that what begins there is seen.
    """
    alpha, offset, effects = _draws(known, chosen)
    draws = alpha, offset, tuple(e for e in effects if isinstance(e, effect))
    rng, size = np.random.default_rng(0), 40
    gear = known.case.gear
    reach = 0.2 * float(gear.geometry.radius)
    if gear.theory == SPRING:
        reach = 10.0 * gear.full_scale.deformation
    sizes = np.exp(rng.uniform(np.log(0.01), np.log(max(reach, 0.1)), size))
    time = np.sort(rng.uniform(0.0, 1e4, size))
    signs = np.where(rng.random(size) < 0.5, -1.0, 1.0)
    rows = np.stack([signs * sizes, rng.uniform(-40.0, 60.0, size), time], axis=1)
    middle = float(np.median(known.values["stiffness"]))
    where = draws, prior.reading, middle * np.array([0.9, 1.0, 1.1]), rows
    together = np.asarray(_readings(*where))
    apart = np.asarray(_readings_apart(*where))
    scale = np.max(np.abs(together))
    if np.max(np.abs(together - apart)) > _SAME * scale:
        return "remembers earlier rows"
    bend = together[0] - 2.0 * together[1] + together[2]
    if np.max(np.abs(bend)) > _SAME * scale:
        return "is not linear in the stiffness"
    return None


def _draws(known: Pooled, chosen: np.ndarray) -> Draws:
    """Return what particles fix; stiffness and zero are their own to learn."""
    values = {name: jnp.asarray(v[chosen]) for name, v in known.values.items()}
    effects = build_effects(known.problem, values)
    return values["alpha"], values["deformation_offset"], effects


@jit
def _readings(draws: Draws, reading: Reading, stiffness, rows):
    """Return the mean reading [N], shape (stiffness, draw, row).

    Args:
        draws: of what is fixed.
        reading: how the rig reads.
        stiffness: radial [N/mm], shape (stiffness,).
        rows: deformation [mm], temperature rise [K] and time [s], shape (row, 3).
    """
    deformation, rise, time = rows.T
    warmth = rise + reading.reference_temperature
    one_gear = np.zeros(len(rows), dtype=int)
    records = grid_records(deformation, warmth, jnp.ones_like(rise), 0.0, one_gear)
    records = replace(records, time=time)

    def one(stiffness, draw: Draws):
        alpha, offset, effects = draw
        base = Base(stiffness, alpha, offset, force_offset=0.0, sigma=1.0)
        return predict_reading(base, effects, records, reading)[0]

    over_draws = jax.vmap(one, in_axes=(None, 0))
    return jax.vmap(over_draws, in_axes=(0, None))(stiffness, draws)


@jit
def _readings_apart(draws: Draws, reading: Reading, stiffness, rows):
    """Return the same of rows that know nothing of each other."""

    def one(row):
        return _readings(draws, reading, stiffness, row[None, :])[:, :, 0]

    return jax.vmap(one, out_axes=2)(rows)


@jit
def _columns(draws: Draws, reading: Reading, ends, row):
    """Return the first columns of `Particles` at one row, shape (3, particle)."""
    low, high = _readings(draws, reading, ends, row[None, :])[:, :, 0]
    slope = (high - low) / (ends[1] - ends[0])
    # Stiffness as read: radial stiffness times the radial displacement per read.
    parts = slope / reading.radial_per_read, low - slope * ends[0], jnp.ones_like(low)
    return jnp.stack(parts)


def _particles(known: Pooled, prior: StreamPrior, chosen) -> Particles:
    draws = known.values
    sites = ["alpha", "deformation_offset"]
    noise = f"{HeteroscedasticNoise.name}."
    sites += [
        name
        for name in known.priors
        if "." in name and name in draws and not name.startswith(noise)
    ]
    fixed = np.stack([draws[name] for name in sites], axis=1)
    sd = fixed.std(axis=0)
    stiffness = np.asarray(prior.base.stiffness) * prior.reading.radial_per_read
    zero = np.asarray(prior.base.force_offset)
    linear = np.column_stack([stiffness, zero, prior.weights])
    scaled = fixed / np.where(sd > 0.0, sd, 1.0)
    return Particles(linear, prior.variance, scaled, prior.cause, chosen)
