"""Readings of the rig at many rows: their means, and one new reading of each draw."""

import jax
import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.exported import jit
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.physics.effect import Noise
from hdcal.prediction.engine.forces import force_of
from hdcal.prediction.engine.population import new_member_sd
from hdcal.prediction.engine.untested import Untested


@jit
def readings(
    problem: Problem,
    values: Values,
    untested: Untested,
    records: Records,
    seed: int,
) -> tuple[Float[Array, "draw n"], Float[Array, "draw n"], Float[Array, "draw n"]]:
    """Return mean reading, the same with the fitted leftover, and a new reading [N].

    All with what untested conditions may add.

    Args:
        problem: structure.
        values: draws by site, with what they leave open: [draw, …].
        untested: what is not known beyond the tested conditions.
        records: from `grid_records`.
        seed: of the new reading, on a new run and a new specimen where these were
            fitted, with the rounding of the rig.
    """
    at = records.deformation
    # A gear that is pulled has the mirrored answer; at rest, that of the tested ones.
    tested = untested.above.end + untested.below.end
    loading = jnp.where(jnp.where(at == 0.0, tested, at) < 0.0, -1.0, 1.0)

    def one(value, key):
        of_run, of_specimen, of_noise = jax.random.split(key, 3)
        zero, moved = untested.drift(value, records.temperature, loading)
        mean, noise = force_of(problem, value, records, zero=zero, moved=moved)
        bends = untested.bends(value)
        bend, fitted = bends.leftover(problem, value, at, loading, records.sense)
        other, factor = 0.0, 1.0
        if problem.runs:
            sd = new_member_sd(value["run_offset_sd"], problem.runs)
            other = sd * jax.random.normal(of_run)
        if problem.specimens:
            sd = new_member_sd(value["specimen_sd"], problem.specimens)
            factor = 1.0 + sd * jax.random.normal(of_specimen)
        member = {"factor": factor, "zero": zero + other, "moved": moved}
        new, _ = force_of(problem, value, records, **member)
        error = _reading_error(of_noise, noise, problem.step)
        left = bend + fitted
        return mean + bend, mean + left, new + left + error

    keys = jax.random.split(jax.random.key(seed), len(values["K"]))
    return jax.vmap(one)(values, keys)


def _reading_error(key, noise: Noise, step):
    """Draw the error of a reading [N], the same quantile in every row.

    Bands are row by row, so that rows may share their random numbers; they are then
    smooth and do not depend on which other rows are asked for. Rounding is uniform
    over its step for the same reason.
    """
    pick, normal, rounding = jax.random.split(key, 3)
    sd = noise.sd[jax.random.categorical(pick, noise.log_weight)]
    uniform = jax.random.uniform(rounding, minval=-0.5, maxval=0.5)
    return sd * jax.random.normal(normal) + step * uniform
