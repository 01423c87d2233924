"""Whether what is sampled, in whatever coordinates, has the density that is stated."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from hdcal.inference.distributions import distribution
from hdcal.inference.laplace import potential, values_at


def log_prior(problem, values):
    """Return the log prior of the named parameters, each in its native coordinate."""
    total = 0.0
    for name, prior in problem.priors_given(values).items():
        if name in values and prior.family != "fixed":
            total = total + distribution(prior, name).log_prob(values[name])
    return total


def base_places(rng, count: int = 8) -> dict[str, np.ndarray]:
    """Return unconstrained places of what every problem has, near those of a gear."""
    return {
        "E0": 12.2 + 0.01 * rng.normal(size=count),
        "_KE0": 13.1 + 0.1 * rng.normal(size=count),
        "alpha": -8.0 + 0.1 * rng.normal(size=count),
        "_centre_force": 57.0 + rng.normal(size=count),
    }


def off_the_stated_density(problem, names, coordinates: Mapping) -> np.ndarray:
    """Return by how much the sampled density is off, at some places, one removed.

    Args:
        problem: the inference problem.
        names: of its parameters, as many as there are coordinates.
        coordinates: unconstrained, by site, each of shape (place,).
    """

    def named(flat, unravel):
        values = values_at(problem, unravel(flat))
        return jnp.stack([values[name] for name in names])

    def off(position):
        flat, unravel = ravel_pytree(position)
        values = values_at(problem, position)
        stated = log_prior(problem, values) + problem.log_likelihood(values)
        moved = jnp.linalg.slogdet(jax.jacfwd(named)(flat, unravel))[1]
        return -potential(problem, position) - stated - moved

    found = np.asarray(jax.jit(jax.vmap(off))(dict(coordinates)))
    return found - found[0]
