"""The probability of a rare exceedance, by importance sampling of the exact posterior.

Of the parameters that make an event rare the draws of a sampler hold few or none: a
mean over them rests on one or two. Here points are drawn about the posterior's mode and
about the likeliest place at which the limit is exceeded, from Student's t, and weighed
by the exact density: P = Σ w P(force > limit) / Σ w, with a Monte Carlo error. Scores
of what the data leave open, such as the rig's drift, are coordinates of a point too.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import log_ndtr, logsumexp
from jaxtyping import Float
from scipy import special
from scipy.optimize import minimize

from hdcal.data.records import Array
from hdcal.exported import jit
from hdcal.inference import laplace
from hdcal.inference.diagnostics import pareto_shape
from hdcal.inference.distributions import distribution
from hdcal.inference.marginal import gap_distribution
from hdcal.prediction.engine.even_points import spread_evenly
from hdcal.prediction.engine.mixture import Mixture
from hdcal.prediction.engine.population_force import (
    SCORES,
    PopulationForce,
    leftover,
    member_mixture,
)
from hdcal.prediction.engine.untested import (
    BENDS,
    PLACES,
    SITES,
    untested_of,
)
from hdcal.prediction.margin.sampling_laws import SamplingLaws

# Points of a round; rounds whose points shape the laws, and rounds that count.
_POINTS, _TRIALS, _COUNTED = 4096, 2, 2
_ABREAST = 4
# Standard normal scores of a point, beside its parameters.
_OPEN = 5
# Slope at which a search ends.
_SLOPE = 1e-3
# Of the levels of a bend's size, the power of their distance from the largest.
_TOWARDS_LARGE = 4.0
# Nodes of a standard normal, and their shares.
_NODES, _SHARES = np.polynomial.hermite_e.hermegauss(9)
_SHARES = _SHARES / _SHARES.sum()
# Degrees of freedom of the scatter that the normal one is compared with.
_HEAVY = 5.0


@dataclass(frozen=True)
class Rare:
    """How probable it is that a limit is exceeded, and what that rests on.

    Attributes:
        probability: of one future member.
        relative_error: Monte Carlo standard error over the probability.
        without_prior: times as probable were nothing known of σ beforehand.
        heavy_tailed: times as probable were the scatter Student's t with five degrees
            of freedom and the same variance.
    """

    probability: float
    relative_error: float
    without_prior: float
    heavy_tailed: float


# Shape of the weights' tail from which on they do not tell their own error (Vehtari,
# Simpson, Gelman, Yao and Gabry, Journal of Machine Learning Research 25, 2024).
_UNTOLD = 0.7

# Of an event too far off for any point to reach.
_NOWHERE = Rare(0.0, np.nan, np.nan, np.nan)


class _Target(eqx.Module):
    """What a point is weighed by: the posterior, and what exceeds the limit.

    A point is a whitened position followed by the scores of what is left open. A force
    that does not scatter exceeds it or not: `blur` [N] gives a search a slope.
    """

    problem: Any
    whitening: laplace.Whitening
    whose: Any
    conditions: Any
    limit: Float[Array, ""]
    blur: Float[Array, ""] | float

    def log_density(self, point: Float[Array, " d"]) -> Float[Array, ""]:
        """Return the log posterior density of a point, but a constant."""
        position, scores = point[:-_OPEN], point[-_OPEN:]
        whole = laplace.potential(self.problem, self.whitening.position(position))
        return -whole - 0.5 * scores @ scores

    def force(self, point: Float[Array, " d"], sizes):
        """Return parameters of a point and the force of the next member along loading.

        Beside it the variance that a leftover adds which is integrated over [N²].
        """
        problem, (position, scores) = self.problem, (point[:-_OPEN], point[-_OPEN:])
        value = laplace.values_at(problem, self.whitening.position(position))
        value |= {SCORES: scores[:2], PLACES: scores[2:], BENDS: sizes}
        free = 0.0
        if "discrepancy" in problem.integrated:
            mean, root = gap_distribution(problem, value)
            row = jax.grad(partial(self._left, value))(mean) @ root
            # Not its root, which has no derivative where the leftover has no part.
            free = row @ row
            value["gap_weights"] = mean
        weight, mean, sd = member_mixture(problem, value, self.whose, self.conditions)
        return value, Mixture(weight, self.conditions.loading * mean, sd), free

    def _left(self, value: dict, weights):
        about = {**value, "gap_weights": weights}
        return leftover(self.problem, about, self.whose.quantity, self.conditions)

    def log_tail(self, point: Float[Array, " d"], sizes) -> Float[Array, ""]:
        """Return the log of about how much exceeds the limit, however little."""
        _, found, free = self.force(point, sizes)
        sd = jnp.sqrt(found.sd**2 + free + self.blur**2)
        tail = log_ndtr((found.mean - self.limit) / sd)
        return logsumexp(jnp.log(found.weight) + tail)

    def terms(self, point: Float[Array, " d"], sizes):
        """Return tail, law of the member, log prior of log σ, and log density."""
        value, found, free = self.force(point, sizes)
        prior, of_sigma = self.problem.priors["sigma"], 0.0
        if prior.family != "fixed":
            law = distribution(prior, "sigma")
            of_sigma = law.log_prob(value["sigma"]) + jnp.log(value["sigma"])
        whole = Mixture(found.weight, found.mean, jnp.sqrt(found.sd**2 + free))
        # Plain arrays: what is traced of them can be kept.
        law = found.weight, found.mean, found.sd, jnp.asarray(free)
        return whole.above(self.limit), law, of_sigma, self.log_density(point)


def _heavy(law: tuple[np.ndarray, ...], limit: float) -> np.ndarray:
    """Return the shares beyond, were the scatter Student's t of the same variance.

    Args:
        law: of the next member at each point, weight, mean and sd of shape (point,
            component), and the variance that a leftover adds [N²], (point,).
        limit: along the sense of loading [N].
    """
    weight, mean, sd, free = law
    scale, total = sd * np.sqrt((_HEAVY - 2.0) / _HEAVY), np.zeros(len(free))
    # What is open of a leftover is no scatter: its law stays normal.
    nodes = zip(_NODES, _SHARES, strict=True) if free.any() else [(0.0, 1.0)]
    for node, share in nodes:
        shifted = mean + node * np.sqrt(free)[:, None]
        beyond = special.stdtr(_HEAVY, (shifted - limit) / scale)
        total += share * np.sum(weight * beyond, axis=1)
    return total


@jit
def _towards(target: _Target, point, sizes):
    """Return −log of density times tail, and its gradient."""

    def height(point):
        return -(target.log_density(point) + target.log_tail(point, sizes))

    return jax.value_and_grad(height)(point)


@jit
def _weigh(target: _Target, points, sizes):
    """Return the terms of points, their leading axis."""

    def one(given):
        return target.terms(*given)

    # Few side by side, the others one after the other, as draws are treated.
    given = jax.tree.map(
        lambda part: part.reshape(_ABREAST, -1, *part.shape[1:]), (points, sizes)
    )
    found = jax.vmap(partial(jax.lax.map, one))(given)
    return jax.tree.map(lambda part: part.reshape(-1, *part.shape[2:]), found)


def rare(force: PopulationForce, limit: float, seed: int = 0) -> Rare:
    """Return how probable it is that a future member's force exceeds a limit.

    Args:
        force: as one cause expects it, at one temperature.
        limit: along the sense of loading, of the force before it is rounded [N].
        seed: of the points.
    """
    weight, above, law, of_sigma = _points(force, limit, seed)
    share = _ratio(weight, above)
    if not share > 0.0:
        return _NOWHERE
    error = np.linalg.norm(weight * (above - share)) / weight.sum() / share
    if max(pareto_shape(weight), pareto_shape(weight * above)) > _UNTOLD:
        error = max(error, 1.0)
    # Without its prior σ would be as likely on any scale.
    free = weight * np.exp(of_sigma.min() - of_sigma)
    return Rare(
        probability=share,
        relative_error=float(error),
        without_prior=_ratio(free, above) / share,
        heavy_tailed=_ratio(weight, _heavy(law, limit)) / share,
    )


def _points(force: PopulationForce, limit: float, seed: int):
    """Return weights of the points that count, and their terms but the density."""
    rounds, rng = _TRIALS + _COUNTED, np.random.default_rng(seed)
    # Large bends are few and count much: the levels are drawn towards them.
    near = spread_evenly(rounds * _POINTS, SITES, seed)
    untested, sites = untested_of(force.cause, 1.0 - near**_TOWARDS_LARGE)
    towards_large = (_TOWARDS_LARGE - 1.0) * np.log(near[:, 0])
    mixture = force.mixture()
    centre = np.sum(np.asarray(mixture.weight) * np.asarray(mixture.mean), axis=-1)
    target = _Target(
        problem=force.cause.problem,
        whitening=force.cause.whitening,
        whose=force.whose,
        conditions=replace(force.conditions, untested=untested),
        limit=np.asarray(limit, float),
        blur=0.1 * float(np.std(centre)),
    )
    laws = _laws(target, np.median(force.cause.values[BENDS], axis=0))
    counted = []
    for turn in range(rounds):
        rows = slice(turn * _POINTS, (turn + 1) * _POINTS)
        points, log_law = laws.drawn(_POINTS, rng)
        found = _weigh(target, points, sites[BENDS][rows])
        *terms, density = jax.tree.map(np.asarray, found)
        density = np.where(np.isfinite(density), density, -np.inf)
        log_weight = density - log_law + towards_large[rows]
        if turn >= _TRIALS:
            counted.append((log_weight, *terms))
            continue
        with np.errstate(divide="ignore"):
            laws = laws.reshaped(points, (log_weight, log_weight + np.log(terms[0])))
    log_weight, *terms = jax.tree.map(lambda *parts: np.concatenate(parts), *counted)
    return np.exp(log_weight - log_weight.max()), *terms


def _laws(target: _Target, sizes) -> SamplingLaws:
    """Return the laws of the first round: about the mode, and about the way beyond."""
    size = len(target.whitening.factor) + _OPEN
    start = np.zeros(size)

    def towards(point):
        value, slope = _towards(target, point, sizes)
        return float(value), np.asarray(slope)

    slope = towards(start)[1]
    options = {"gtol": _SLOPE}
    found = minimize(towards, start, jac=True, method="BFGS", options=options)
    counts = np.append(np.ones(size - _OPEN, bool), slope[-_OPEN:] != 0.0)
    place, shape = found.x[counts], found.hess_inv[np.ix_(counts, counts)]
    return SamplingLaws(counts, ((0.0 * place, np.eye(len(place))), (place, shape)))


def _ratio(weight: np.ndarray, values: np.ndarray) -> float:
    return float(weight @ values / weight.sum())


def pooled_rare(found: Sequence[tuple[float, Rare]]) -> Rare:
    """Return the probability over several causes.

    Args:
        found: of each cause its probability, and how rare it makes the event.
    """
    found = [(share, one) for share, one in found if one.probability > 0.0]
    if not found:
        return _NOWHERE
    parts = np.array([share * one.probability for share, one in found])
    each = [one for _, one in found]
    of_each = parts / parts.sum()
    errors = np.array([one.relative_error for one in each])
    return Rare(
        probability=float(parts.sum()),
        relative_error=float(np.linalg.norm(of_each * errors)),
        without_prior=float(of_each @ [one.without_prior for one in each]),
        heavy_tailed=float(of_each @ [one.heavy_tailed for one in each]),
    )
