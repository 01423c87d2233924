"""The likelihood of a problem's data, whatever form they are kept in."""

from functools import partial, singledispatch

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.exported import jit
from hdcal.inference.distributions import distribution
from hdcal.inference.likelihood import log_probability
from hdcal.inference.marginal import linear_part
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.serial_correlation import given_before
from hdcal.inference.values import (
    Values,
    correlation_of,
    predict_rows,
    with_rounding,
)
from hdcal.physics.effect import Noise


def pointwise_log_likelihood(
    problem: Problem, values: Values, records: Records, columns, before
) -> Float[Array, " n"]:
    """Return the log likelihood of each row given all values [log 1/N].

    And given the rows before it in its run, where neighbours may be correlated.

    Args:
        problem: structure.
        values: parameters of one draw.
        records: the rows.
        columns: basis of the discrepancy at the rows, or None.
        before: index of the row before each in its run, or None.
    """
    mean, noise = predict_rows(problem, values, records, columns)
    noise = with_rounding(noise, problem.step, rounded=problem.rounded)
    if problem.correlated:
        (sd,), correlation = noise.sd, correlation_of(values)
        error = (records.force - mean) / sd
        mean, sd = given_before(mean, sd, error, before, correlation)
        noise = Noise(noise.log_weight, sd[None])
    return log_probability(
        records.force, mean, noise, problem.step, rounded=problem.rounded
    )


@singledispatch
def log_likelihood(problem: Sampled, values: Values) -> Float[Array, ""]:
    """Return the log likelihood of all data, members integrated out where they can.

    Padding counts for nothing.
    """
    raise NotImplementedError(type(problem).__name__)


@log_likelihood.register
def _(problem: Problem, values: Values) -> Float[Array, ""]:
    if problem.integrated or problem.blocks is not None:
        return linear_part(problem, values).log_likelihood()
    rows = problem.rows, problem.columns, problem.before
    each = pointwise_log_likelihood(problem, values, *rows)
    return jnp.sum(jnp.where(measured(len(each), problem.count), each, 0.0))


def log_prior(problem: Sampled, values: Values) -> Float[Array, ""]:
    """Return the log prior of the named parameters, each in its own coordinate."""
    total = jnp.zeros(())
    for name, prior in problem.priors_given(values).items():
        if name in values and prior.family != "fixed":
            total = total + distribution(prior, name).log_prob(values[name])
    return total


def densities(problem: Sampled, draws: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return log prior and log likelihood of each draw, (chain, draw) each."""
    of_prior, of_data = _densities(problem, draws)
    return np.asarray(of_prior), np.asarray(of_data)


@jit
def _densities(problem: Sampled, values):
    def both(one):
        return log_prior(problem, one), log_likelihood(problem, one)

    # One draw after the other: side by side rows by the thousand fill the memory.
    return jax.vmap(partial(jax.lax.map, both))(values)
