"""The posterior mode and its curvature: whitened coordinates of the sampler."""

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache, partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Float
from numpyro.distributions import biject_to
from numpyro.handlers import substitute, trace
from numpyro.infer.util import constrain_fn, potential_energy
from scipy.optimize import minimize

from hdcal.data.records import Array
from hdcal.inference.sampled_problem import Sampled, model

Position = dict[str, Any]

# Length of the gradient at which a search ends [nat per posterior sd], the largest
# radius of its trust region in such units, and the most steps.
_OPTIONS = {"gtol": 1e-6, "max_trust_radius": 1e4, "maxiter": 300}


class Whitening(eqx.Module):
    """Affine map from standard to unconstrained coordinates: x = centre + factor·e.

    The centre is the posterior mode by site name, and the factor a root of the inverse
    Hessian there, rows in the order of the flattened centre.
    """

    centre: Position
    factor: Float[Array, "d d"]

    def position(self, standard: Float[Array, " d"]) -> Position:
        """Return the unconstrained position of standard coordinates."""
        flat, unravel = ravel_pytree(self.centre)
        return unravel(flat + self.factor @ standard)


@jax.jit
def potential(problem: Sampled, position: Position) -> Float[Array, ""]:
    """Return −log posterior density in unconstrained coordinates, up to a constant."""
    return jnp.asarray(potential_energy(model, (problem,), {}, position))


@jax.jit
def values_at(problem: Sampled, position: Position) -> dict[str, Any]:
    """Return the parameters at an unconstrained position, coordinates left out."""
    values = constrain_fn(model, (problem,), {}, position, return_deterministic=True)
    return {name: v for name, v in values.items() if not name.startswith("_")}


def fit(problem: Sampled, start: Mapping[str, float] | None = None) -> Whitening:
    """Find the posterior mode and its curvature.

    A poor mode costs speed, never correctness: NUTS samples the exact density in any
    coordinates. The search starts at known values of sites, by default those of the
    problem, else in the middle of the priors.
    """
    known = problem.start if start is None else start
    place, flat = _start(problem, dict(known))
    flat = np.asarray(flat)
    hessian = np.asarray(_expand(problem, place, flat)[2])
    # Parameters differ by many orders in scale: a trust region needs one scale.
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(hessian)), 1e-12))

    @lru_cache(maxsize=1)
    def expand(*u: float):
        parts = _expand(problem, place, flat + scale * np.array(u))
        value, slope, curve = map(np.asarray, parts)
        if not all(np.isfinite(part).all() for part in (value, slope, curve)):
            return np.inf, np.zeros(len(u)), np.eye(len(u))
        return float(value), slope * scale, curve * scale * scale[:, None]

    result = minimize(
        lambda u: expand(*u)[:2],
        np.zeros(len(flat)),
        jac=True,
        hess=lambda u: expand(*u)[2],
        method="trust-exact",
        options=_OPTIONS,
    )
    # A root of the inverse of |Hessian|, its eigenvalues floored.
    values, vectors = np.linalg.eigh(result.hess)
    values = np.maximum(np.abs(values), 1e-8 * np.abs(values).max())
    factor = scale[:, None] * vectors / np.sqrt(values)
    return Whitening(_position(place, flat + scale * result.x), factor)


@jax.jit
def _start(problem: Sampled, known: Position) -> tuple[Position, Float[Array, " d"]]:
    """Return the position where a search starts, and the same flattened.

    A known value outside the support of its prior is left out.
    """
    choose = partial(_first_value, known=known)
    sites = trace(substitute(model, substitute_fn=choose)).get_trace(problem)
    position = {
        name: biject_to(site["fn"].support).inv(site["value"])
        for name, site in sites.items()
        if _is_parameter(site)
    }
    return position, ravel_pytree(position)[0]


def _first_value(site: dict[str, Any], known: Position):
    """Return the known value of a site, if it can be, else the prior's middle."""
    if not _is_parameter(site):
        return None
    fn, middle = site["fn"], _prior_middle(site["fn"])
    if site["name"] not in known:
        return middle
    # Outside the support, or at its ends, the coordinate is NaN or infinite.
    value = jnp.asarray(known[site["name"]], float)
    possible = jnp.isfinite(biject_to(fn.support).inv(value)).all()
    return jnp.where(possible, value, middle)


def _is_parameter(site: dict[str, Any]) -> bool:
    return site["type"] == "sample" and not site["is_observed"]


def _prior_middle(fn: Any):
    """Return the median of a prior, its mean, or else the middle of its support."""
    for middle in (lambda: fn.icdf(0.5), lambda: fn.mean):
        with suppress(NotImplementedError, ImportError):
            return middle()
    return biject_to(fn.support)(0.0)


@jax.jit
def _position(like: Position, flat) -> Position:
    return ravel_pytree(like)[1](flat)


@jax.jit
def _expand(problem: Sampled, like: Position, flat):
    """Return the typical potential with its gradient and Hessian at a flat position."""
    _, unravel = ravel_pytree(like)
    expand = jax.value_and_grad(lambda x: _typical(problem, unravel(x)))

    def along(direction):
        (value, slope), (_, row) = jax.jvp(expand, (flat,), (direction,))
        return value, slope, row

    # One row of the Hessian after the other: half the tracing of `jax.hessian`.
    value, slope, curve = jax.lax.map(along, jnp.eye(len(flat)))
    # Rounding can leave the halves of the Hessian apart, far from the mode.
    return value[0], slope[0], 0.5 * (curve + curve.T)


def _typical(problem: Sampled, position: Position) -> Float[Array, ""]:
    """Return the potential whose minimum is a typical position, not only the mode.

    A discrepancy that is sampled can interpolate while sigma vanishes: there the
    density is highest, in next to no volume, and a sampler that starts there stays.
    The volume is a factor: sigma to the power of the number of weights.
    """
    value, weights = potential(problem, position), problem.sampled_weights
    if not weights:
        return value
    return value - weights * jnp.log(values_at(problem, position)["sigma"])
