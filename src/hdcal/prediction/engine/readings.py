"""Readings of the rig at many rows: their means, and one new reading of each draw."""

import jax
from jaxtyping import Float, Key

from hdcal.data.records import Array, Records
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values
from hdcal.physics.effect import Noise
from hdcal.prediction.engine.forces import force_of, leftover_of
from hdcal.prediction.engine.population import new_member_sd


@jax.jit
def readings(
    problem: Problem, values: Values, records: Records, keys: Key[Array, " draw"]
) -> tuple[Float[Array, "draw n"], Float[Array, "draw n"], Float[Array, "draw n"]]:
    """Return mean reading, the same with the leftover, and a new reading [N].

    Args:
        problem: structure.
        values: draws by site: [draw, …].
        records: from `grid_records`.
        keys: of the new reading, on a new run and a new specimen where these were
            fitted, with the rounding of the rig.
    """

    def one(value, key):
        of_run, of_specimen, of_noise = jax.random.split(key, 3)
        mean, noise = force_of(problem, value, records)
        leftover = leftover_of(problem, value, records.deformation)
        zero, factor = 0.0, 1.0
        if problem.runs:
            sd = new_member_sd(value["run_offset_sd"], problem.runs)
            zero = sd * jax.random.normal(of_run)
        if problem.specimens:
            sd = new_member_sd(value["specimen_sd"], problem.specimens)
            factor = 1.0 + sd * jax.random.normal(of_specimen)
        new, _ = force_of(problem, value, records, factor=factor, zero=zero)
        error = _reading_error(of_noise, noise, problem.step)
        return mean, mean + leftover, new + leftover + error

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
