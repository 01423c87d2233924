"""The Laplace fit: where the posterior is and how it is shaped, for whitening."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax.flatten_util import ravel_pytree
from jaxtyping import Float
from numpyro.distributions import biject_to
from numpyro.handlers import substitute, trace
from numpyro.infer.util import constrain_fn, potential_energy, unconstrain_fn
from scipy.optimize import OptimizeResult, minimize

from hdcal.data.records import Array
from hdcal.exported import jit
from hdcal.inference.problem import Problem
from hdcal.inference.sampled_problem import Sampled, model

Position = dict[str, Any]

# Length of the gradient at which a search ends [nat per posterior sd], the largest
# radius of its trust region in such units, and the most steps.
_TOLERANCE, _LARGEST_RADIUS, _MOST_STEPS = 1e-6, 1e4, 300
# The group of a posterior file that holds it.
GROUP = "laplace"
# A search among kinks of the density ends when so many steps gained less [nat].
_STEPS, _LEAST_GAIN = 12, 1e-3


class Whitening(eqx.Module):
    """Affine map from standard to unconstrained coordinates: x = centre + factor·e.

    Attributes:
        centre: the posterior mode, one entry per site name.
        factor: Cholesky factor of the inverse Hessian there, rows in the order of
            the flattened centre.
    """

    centre: Position
    factor: Float[Array, "d d"]

    def position(self, standard: Float[Array, " d"]) -> Position:
        """Return the unconstrained position of standard coordinates."""
        flat, unravel = ravel_pytree(self.centre)
        return unravel(flat + self.factor @ standard)


@jit
def potential(problem: Sampled, position: Position) -> Float[Array, ""]:
    """Return −log posterior density in unconstrained coordinates, up to a constant."""
    return jnp.asarray(potential_energy(model, (problem,), {}, position))


def constrained(problem: Sampled, position: Position) -> dict[str, Any]:
    """Return every site at an unconstrained position, and what follows from them."""
    return constrain_fn(model, (problem,), {}, position, return_deterministic=True)


@jit
def values_at(problem: Sampled, position: Position) -> dict[str, Any]:
    """Return the parameters at an unconstrained position, coordinates left out."""
    values = constrained(problem, position)
    return {name: v for name, v in values.items() if not name.startswith("_")}


def _typical(problem: Sampled, position: Position) -> Float[Array, ""]:
    """Return the potential whose minimum is a typical place, not only the mode.

    A discrepancy that is sampled can interpolate while sigma vanishes: there the
    density is highest, in next to no volume, and a sampler that starts there stays. The
    volume is counted in: sigma to the power of the number of its weights.
    """
    value = potential(problem, position)
    if not isinstance(problem, Problem) or problem.discrepancy is None:
        return value
    if "discrepancy" in problem.integrated:
        return value
    values = constrained(problem, position)
    return value - problem.discrepancy.size * jnp.log(values["sigma"])


def _flatten(position: Position) -> np.ndarray:
    """Return the coordinates of a position, in the order of `ravel_pytree`."""
    leaves = jax.tree.leaves(position)
    return np.concatenate([np.ravel(np.asarray(leaf, float)) for leaf in leaves])


def _unflatten(like: Position, flat: np.ndarray) -> Position:
    """Return the position with these coordinates."""
    leaves, structure = jax.tree.flatten(like)
    ends = np.cumsum([np.size(leaf) for leaf in leaves])[:-1]
    parts = zip(np.split(flat, ends), leaves, strict=True)
    shaped = [part.reshape(np.shape(leaf)) for part, leaf in parts]
    return jax.tree.unflatten(structure, shaped)


@jit
def _expand(problem: Sampled, like: Position, flat):
    """Return the typical potential with its gradient and Hessian.

    Args:
        problem: the inference problem.
        like: any position of the problem.
        flat: where to expand, flattened.
    """
    _, unravel = ravel_pytree(like)

    expand = jax.value_and_grad(lambda x: _typical(problem, unravel(x)))

    def along(direction):
        (value, slope), (_, row) = jax.jvp(expand, (flat,), (direction,))
        return value, slope, row

    # One row of the Hessian after the other: half the tracing of `jax.hessian`.
    value, slope, curve = jax.lax.map(along, jnp.eye(len(flat)))
    # Rounding can leave the halves of the Hessian apart, far from the mode.
    return value[0], slope[0], 0.5 * (curve + curve.T)


def _middle(site: dict[str, Any]):
    """Return the prior median of a site, or its mean where no median is stated."""
    if site["type"] != "sample" or site["is_observed"]:
        return None
    try:
        return site["fn"].icdf(0.5)
    except (NotImplementedError, ImportError):
        return site["fn"].mean


@jit
def _prior_middle(problem: Sampled) -> Position:
    """Return the middle of the prior, unconstrained."""
    sites = trace(substitute(model, substitute_fn=_middle)).get_trace(problem)
    return {
        name: biject_to(site["fn"].support).inv(site["value"])
        for name, site in sites.items()
        if site["type"] == "sample" and not site["is_observed"]
    }


@jit
def _moved(problem: Sampled, position: Position, values) -> Position:
    """Return the position with some sites moved to given values."""
    known = constrain_fn(model, (problem,), {}, position) | values
    return unconstrain_fn(model, (problem,), {}, known)


def fit(
    problem: Sampled,
    start: Mapping[str, float] | None = None,
) -> Whitening:
    """Find the posterior mode and its curvature.

    The mode only shapes the sampler's coordinates: a poor one costs speed, never
    correctness, because NUTS samples the exact density in any coordinates.

    Args:
        problem: the inference problem.
        start: sites whose value to start from instead, where it is roughly known.
    """
    place = _prior_middle(problem)
    if start:
        place = _moved(problem, place, dict(start))
    flat = _flatten(place)
    hessian = np.asarray(_expand(problem, place, flat)[2])
    # Parameters differ by many orders in scale: a trust region wants them alike.
    scale = 1.0 / np.sqrt(np.maximum(np.abs(np.diag(hessian)), 1e-12))

    @lru_cache(maxsize=1)
    def expand(*u: float):
        parts = _expand(problem, place, flat + scale * np.array(u))
        value, slope, curve = map(np.asarray, parts)
        if not all(np.isfinite(part).all() for part in (value, slope, curve)):
            return np.inf, np.zeros(len(u)), np.eye(len(u))
        return float(value), slope * scale, curve * scale * scale[:, None]

    found = minimize(
        lambda u: expand(*u)[:2],
        np.zeros(len(flat)),
        jac=True,
        hess=lambda u: expand(*u)[2],
        method="trust-exact",
        callback=_stop_at_kink() if problem.bent else None,
        options={
            "gtol": _TOLERANCE,
            "max_trust_radius": _LARGEST_RADIUS,
            "maxiter": _MOST_STEPS,
        },
    )
    factor = scale[:, None] * _inverse_root(found.hess)
    return Whitening(_unflatten(place, flat + scale * found.x), factor)


def _stop_at_kink():
    """Return a callback that ends a search which gains nothing more.

    At a kink the gradient does not vanish.
    """
    levels: list[float] = []

    def stop(intermediate_result: OptimizeResult) -> None:
        levels.append(float(intermediate_result.fun))
        if len(levels) > _STEPS and levels[-1 - _STEPS] - levels[-1] < _LEAST_GAIN:
            raise StopIteration

    return stop


def to_group(found: Whitening) -> xr.Dataset:
    """Return a fit as a group of a posterior's tree."""
    axes = "coordinate", "standard"
    mode, factor = _flatten(found.centre), np.asarray(found.factor)
    return xr.Dataset({"mode": (axes[:1], mode), "factor": (axes, factor)})


def from_group(problem: Sampled, group: xr.Dataset) -> Whitening:
    """Return the fit of a group that `to_group` made.

    Args:
        problem: the inference problem.
        group: of a posterior of this problem.
    """
    centre = _unflatten(_prior_middle(problem), group["mode"].values)
    return Whitening(centre, group["factor"].values)


def sites_at(problem: Sampled, position: Position) -> dict[str, float]:
    """Return the value of every sampled site at a position, as `fit` starts from it."""
    return {name: float(value) for name, value in _sites(problem, position).items()}


@jit
def _sites(problem: Sampled, position: Position) -> dict[str, Any]:
    return constrain_fn(model, (problem,), {}, position)


def log_evidence(problem: Sampled, found: Whitening) -> float:
    """Return the log probability of the data under a model, by Laplace's method.

    As if the density were normal around its mode: −U + ½ d log 2π + log|factor|, U the
    potential at the mode. An approximation, and of the one mode that was found.

    Args:
        problem: the inference problem.
        found: its mode and curvature, from `fit`.
    """
    volume = np.linalg.slogdet(found.factor)[1]
    volume += 0.5 * len(found.factor) * np.log(2.0 * np.pi)
    return float(volume - potential(problem, found.centre))


def _inverse_root(hessian: np.ndarray) -> np.ndarray:
    """Return a root of the inverse of |hessian|, its eigenvalues floored."""
    values, vectors = np.linalg.eigh(hessian)
    values = np.maximum(np.abs(values), 1e-8 * np.abs(values).max())
    return vectors / np.sqrt(values)
