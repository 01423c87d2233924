"""The likelihood of a problem's data, whatever form they are kept in."""

from functools import partial, singledispatch

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.inference import compress
from hdcal.inference.distributions import distribution
from hdcal.inference.integrated import linear_part
from hdcal.inference.likelihood import log_probability
from hdcal.inference.padding import measured
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.values import (
    POSITIVE,
    Values,
    block_coefficients,
    predict_rows,
    with_rounding,
)


def pointwise_log_likelihood(
    problem: Problem, values: Values, records: Records, columns
) -> Float[Array, " n"]:
    """Return the log likelihood of each row given all values [log 1/N]."""
    mean, noise = predict_rows(problem, values, records, columns)
    if not problem.rounded:
        noise = with_rounding(noise, problem.step)
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
    if problem.integrated:
        return linear_part(problem, values).log_likelihood()
    if problem.blocks is not None:
        coefficients = block_coefficients(problem, problem.blocks, values)
        return compress.log_likelihood(
            problem.blocks, coefficients, values["sigma"], problem.step
        )
    rows, columns = problem.rows, problem.columns
    each = pointwise_log_likelihood(problem, values, rows, columns)
    return jnp.sum(jnp.where(measured(len(each), problem.count), each, 0.0))


def log_prior(problem: Sampled, values: Values) -> Float[Array, ""]:
    """Return the log prior of the named parameters, each in its own coordinate."""
    total = jnp.zeros(())
    for name, prior in problem.priors.items():
        if name in values and prior.family != "fixed":
            law = distribution(prior, positive=name in POSITIVE)
            total = total + law.log_prob(values[name])
    return total


def densities(problem: Sampled, draws: Values) -> tuple[np.ndarray, np.ndarray]:
    """Return log prior and log likelihood of each draw, (chain, draw) each."""
    of_prior, of_data = _densities(problem, draws)
    return np.asarray(of_prior), np.asarray(of_data)


@jax.jit
def _densities(problem: Sampled, values):
    def both(one):
        return log_prior(problem, one), log_likelihood(problem, one)

    # One draw after the other: side by side rows by the thousand fill the memory.
    return jax.vmap(partial(jax.lax.map, both))(values)
