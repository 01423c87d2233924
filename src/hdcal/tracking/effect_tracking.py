"""A posterior with effects as particles, if its effects can be followed row by row."""

from collections.abc import Callable
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from hdcal.errors import Finding, InputError
from hdcal.inference.density import build_effects
from hdcal.inference.posterior import Posterior
from hdcal.physics.chain import Base, predict_reading
from hdcal.physics.effect import Effect
from hdcal.prediction.engine.forces import grid_records
from hdcal.tracking.linear_core import match
from hdcal.tracking.particles import Mean, ParticleCore, conditional
from hdcal.tracking.stream_prior import Beginning

PARTICLES = 256
# What a line of the stream can carry beside deformation and force.
CARRIED = frozenset({"temperature", "time"})
_SAME = 1e-9


def build_particles(
    posterior: Posterior, begin: Beginning, forget: float
) -> tuple[ParticleCore, Mean]:
    """Return particles of a posterior with effects, and what they make of a row.

    Args:
        posterior: that may be used.
        begin: of the same posterior.
        forget: has to be 1.

    Raises:
        InputError: an effect remembers earlier rows, needs what a stream does not
            carry, shapes the noise, or is not linear in the stiffness.
    """
    chosen = np.linspace(0, len(posterior.draws["K"]) - 1, PARTICLES).astype(int)
    findings = []
    for effect in posterior.problem.effects:
        words = _unfit(effect) or _trial(effect, posterior, begin, chosen[::16])
        if words:
            remedy = "Calibrate without it, or diagnose blocks of rows"
            problem = f"its effect '{effect.name}' {words}"
            findings.append(Finding("RUN", problem, remedy))
    if forget < 1.0:
        words = "does not go with effects"
        findings.append(Finding("--forget", words, "Leave it out"))
    if findings:
        raise InputError(findings)
    of_rows = _mean_of_rows(posterior, begin, chosen)
    core = _core(posterior, begin, chosen)
    middle = float(np.mean(np.asarray(begin.base.stiffness)))
    pair = jnp.array([0.8, 1.2]) * middle
    per_read = begin.reading.radial_per_read
    compiled = jax.jit(lambda row: of_rows(row[None, :], pair)[:, :, 0])

    def mean(deformation: float, rise: float, time: float):
        low, high = np.asarray(compiled(np.array([deformation, rise, time])))
        slope = (high - low) / (0.4 * middle)
        # Stiffness as read: radial stiffness times the radial displacement per read.
        return low - slope * 0.8 * middle, slope / per_read

    return core, mean


def _unfit(effect: type[Effect]) -> str | None:
    """Say why an effect cannot be followed, as far as it declares it."""
    if effect.stage == "noise":
        return "shapes the noise, which is taken as one normal"
    lacking = sorted(effect.needs - CARRIED)
    return f"needs {', '.join(lacking)}, which a stream lacks" if lacking else None


def _mean_of_rows(
    posterior: Posterior, begin: Beginning, chosen: np.ndarray, only: str | None = None
) -> Callable:
    """Return the function (rows, stiffnesses) → mean reading [stiffness, draw, row].

    Args:
        posterior: whose draws fix everything but stiffness and zero.
        begin: of the same posterior.
        chosen: draws.
        only: name of the one effect to keep.
    """
    problem = posterior.problem
    values = {name: jnp.asarray(v[chosen]) for name, v in posterior.draws.items()}

    def one(value, stiffness, rows):
        records = grid_records(rows[:, 0], rows[:, 1], jnp.ones(len(rows)), 0.0)
        warmth = rows[:, 1] + begin.reading.reference_temperature
        records = replace(records, temperature=warmth, time=rows[:, 2])
        base = Base(stiffness, value["alpha"], value["deformation_offset"], 0.0, 1.0)
        effects = build_effects(problem, value)
        kept = tuple(e for e in effects if only in (None, e.name))
        return predict_reading(base, kept, records, begin.reading)[0]

    over_draws = jax.vmap(one, in_axes=(0, None, None))
    over_both = jax.vmap(over_draws, in_axes=(None, 0, None))

    def of_rows(rows, stiffnesses):
        return over_both(values, stiffnesses, rows)

    return of_rows


def _trial(effect: type[Effect], posterior, begin, chosen) -> str | None:
    """Try whether a row's force depends on other rows, or bends in the stiffness.

    The trial goes far beyond the tested range, so that what begins there is seen.
    """
    of_rows = _mean_of_rows(posterior, begin, chosen, effect.name)
    rng, size = np.random.default_rng(0), 40
    reach = 0.2 * float(posterior.case.gear.geometry.radius)
    sizes = np.exp(rng.uniform(np.log(0.01), np.log(max(reach, 0.1)), size))
    time = np.sort(rng.uniform(0.0, 1e4, size))
    signs = np.where(rng.random(size) < 0.5, -1.0, 1.0)
    rows = np.stack([signs * sizes, rng.uniform(-40.0, 60.0, size), time], axis=1)
    middle = float(np.median(posterior.draws["stiffness"]))
    levels = middle * np.array([0.9, 1.0, 1.1])
    together = np.asarray(jax.jit(of_rows)(rows, levels))
    alone = jax.jit(lambda row: of_rows(row[None, :], levels)[:, :, 0])
    apart = np.stack([np.asarray(alone(row)) for row in rows], axis=-1)
    scale = np.max(np.abs(together))
    if np.max(np.abs(together - apart)) > _SAME * scale:
        return "remembers earlier rows"
    bend = together[0] - 2.0 * together[1] + together[2]
    if np.max(np.abs(bend)) > _SAME * scale:
        return "is not linear in the stiffness"
    return None


def _core(posterior: Posterior, begin: Beginning, chosen: np.ndarray) -> ParticleCore:
    draws, base = posterior.draws, begin.base
    sites = ["alpha", "deformation_offset"]
    sites += [name for name in posterior.priors if "." in name and name in draws]
    fixed = np.stack([draws[name] for name in sites], axis=1)
    sd = fixed.std(axis=0)
    stiffness = np.asarray(base.stiffness) * begin.reading.radial_per_read
    linear = np.stack([stiffness, np.asarray(base.force_offset)], axis=1)
    mean, covariance = conditional(linear, fixed / np.where(sd > 0.0, sd, 1.0), chosen)
    start = match(linear, begin.variance)
    spread = covariance / (start.rate / start.shape)
    return ParticleCore(mean, spread, start.shape, start.rate)
