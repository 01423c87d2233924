"""The probability of a rare exceedance, by importance sampling of the exact posterior.

Of the parameters that make an event rare the draws of a sampler hold few or none: a
mean over them rests on one or two. Here points are drawn about the posterior's mode and
about the likeliest place at which the limit is exceeded, from Student's t, and weighed
by the exact density: P = Σ w P(force > limit) / Σ w, with a Monte Carlo error.
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
from scipy import optimize, stats
from scipy.special import ndtri

from hdcal.data.records import Array
from hdcal.inference import laplace
from hdcal.inference.distributions import distribution
from hdcal.inference.integrated import draw_members
from hdcal.prediction.engine.population_force import (
    SCORES,
    PopulationForce,
    member_mixture,
)
from hdcal.prediction.engine.untested import SITES, spread_evenly, untested_of
from hdcal.prediction.margin.bounds import LEAST, LEAST_LEFT
from hdcal.prediction.margin.result import Level

# Points about each of both places, and degrees of freedom of their law.
_POINTS, _FREE = 8192, 5.0
_ABREAST = 4
# How much wider than the posterior's own shape the points are spread.
_SPREAD = 1.3
# Degrees of freedom of the scatter that the normal one is compared with.
_HEAVY = 5.0
# Relative Monte Carlo error up to which a mean over the sampler's draws is good enough.
_ENOUGH = 0.1
# By how many times an assumption must move a probability to be told.
_TOLD = 1.5


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


class _Target(eqx.Module):
    """What a point is weighed by: the posterior, and what exceeds the limit.

    A force that does not scatter exceeds it or not: `blur` [N] gives a search a slope.
    """

    problem: Any
    whitening: laplace.Whitening
    whose: Any
    conditions: Any
    limit: Float[Array, ""]
    blur: Float[Array, ""] | float

    def log_density(self, point: Float[Array, " d"]) -> Float[Array, ""]:
        """Return the log posterior density in whitened coordinates, but a constant."""
        return -laplace.potential(self.problem, self.whitening.position(point))

    def terms(self, point: Float[Array, " d"], sites: dict, key, blur: Any = 0.0):
        """Return log tails, normal and heavy, and the log prior of σ's logarithm."""
        named = laplace.values_at(self.problem, self.whitening.position(point))
        value = named | draw_members(self.problem, named, key) | sites
        weight, mean, sd = member_mixture(
            self.problem, value, self.whose, self.conditions
        )
        room = (self.conditions.loading * mean - self.limit) / jnp.hypot(sd, blur)
        prior = self.problem.priors["sigma"]
        of_sigma = 0.0
        if prior.family != "fixed":
            law = distribution(prior, positive=True)
            of_sigma = law.log_prob(value["sigma"]) + jnp.log(value["sigma"])
        log_weight = jnp.log(weight)
        tails = (log_ndtr(room), _log_heavy(room))
        return *(logsumexp(log_weight + tail) for tail in tails), of_sigma


def _log_heavy(room):
    """Return the log of Student's share beyond, of five degrees and variance 1."""
    z = room * np.sqrt(_HEAVY / (_HEAVY - 2.0))
    # The regularised incomplete beta function, for whole halves of the degrees.
    share = jax.scipy.special.betainc(_HEAVY / 2.0, 0.5, _HEAVY / (_HEAVY + z**2))
    return jnp.log(jnp.where(z < 0.0, 0.5 * share, 1.0 - 0.5 * share))


@jax.jit
def _towards(target: _Target, point, sites):
    """Return −log of density times tail, and its gradient."""

    def height(point):
        tail, *_ = target.terms(point, sites, jax.random.key(0), target.blur)
        return -(target.log_density(point) + tail)

    return jax.value_and_grad(height)(point)


@jax.jit
def _weigh(target: _Target, points, sites, keys):
    """Return the terms of points and their log densities, each (point,)."""

    def one(given):
        point, own, key = given
        return *target.terms(point, own, key), target.log_density(point)

    # Few side by side, the others one after the other, as draws are treated.
    given = jax.tree.map(
        lambda part: part.reshape(_ABREAST, -1, *part.shape[1:]), (points, sites, keys)
    )
    found = jax.vmap(partial(jax.lax.map, one))(given)
    return jax.tree.map(jnp.ravel, found)


def rare(force: PopulationForce, limit: float, seed: int = 0) -> Rare:
    """Return how probable it is that a future member's force exceeds a limit.

    Args:
        force: as one cause expects it, at one temperature.
        limit: along the sense of loading [N].
        seed: of the points.
    """
    problem = force.cause.problem
    levels = spread_evenly(2 * _POINTS, 2 + SITES, seed)
    untested, sites = untested_of(force.cause, levels[:, 2:])
    sites = {**sites, SCORES: ndtri(levels[:, :2])}
    where = replace(force.conditions, untested=untested)
    whitening = laplace.fit(problem)
    blur = 0.1 * float(np.std(np.asarray(force.along().centre())))
    target = _Target(problem, whitening, force.whose, where, jnp.asarray(limit), blur)
    points, log_law = _points(target, sites, np.random.default_rng(seed))
    keys = jax.random.split(jax.random.key(seed), len(points))
    found = _weigh(target, points, sites, keys)
    normal, heavy, of_sigma, density = map(np.asarray, found)
    weight = np.where(np.isfinite(density), density, -np.inf) - log_law
    weight, above = np.exp(weight - weight.max()), np.exp(normal)
    share = _ratio(weight, above)
    error = np.linalg.norm(weight * (above - share)) / weight.sum()
    # Without its prior σ would be as likely on any scale.
    free = weight * np.exp(of_sigma.min() - of_sigma)
    return Rare(
        probability=share,
        relative_error=float(error / share),
        without_prior=_ratio(free, above) / share,
        heavy_tailed=_ratio(weight, np.exp(heavy)) / share,
    )


def _points(target: _Target, sites: dict, rng) -> tuple[np.ndarray, np.ndarray]:
    """Return whitened points about both places, and the log density of their law."""
    even = {name: np.median(column, axis=0) for name, column in sites.items()}
    size = len(target.whitening.factor)
    found = optimize.minimize(
        lambda x: tuple(map(np.asarray, _towards(target, x, even))),
        np.zeros(size),
        jac=True,
        method="BFGS",
        options={"maxiter": 200, "gtol": 1e-3},
    )
    shape, place = found.hess_inv, found.x
    if not (np.isfinite(shape).all() and np.isfinite(place).all()):
        shape, place = np.eye(size), np.zeros(size)
    strength, axes = np.linalg.eigh(0.5 * (shape + shape.T))
    spread = (axes * np.maximum(strength, 1e-8 * strength.max())) @ axes.T
    laws: list[Any] = [
        stats.multivariate_t(centre, _SPREAD**2 * shape, df=_FREE)  # pyright: ignore
        for centre, shape in ((np.zeros(size), np.eye(size)), (place, spread))
    ]
    drawn = [np.reshape(law.rvs(_POINTS, random_state=rng), (-1, size)) for law in laws]
    # What is open is spread evenly over both places.
    points = rng.permutation(np.concatenate(drawn))
    return points, np.logaddexp(*(np.atleast_1d(law.logpdf(points)) for law in laws))


def refined(
    level: Level, forces: Sequence[PopulationForce], limit: float | None, seed: int
) -> Level:
    """Return a level whose probability of exceedance does not hang on a few draws.

    Args:
        level: of all causes.
        forces: of each cause, at its temperature.
        limit: along the sense of loading [N], or None.
        seed: of the points.
    """
    risk = level.exceedance
    if risk is None or limit is None or risk.relative_error <= _ENOUGH:
        return level
    # What cannot be computed stays what was counted.
    with np.errstate(all="ignore"):
        each = [(force.cause.probability, rare(force, limit, seed)) for force in forces]
        found = pooled_rare(each)
    if not found.relative_error < risk.relative_error:
        return level
    chance = float(np.clip(found.probability, LEAST, 1.0 - LEAST_LEFT))
    better = replace(
        risk,
        probability=chance,
        beta=float(-ndtri(chance)),
        relative_error=found.relative_error,
        rests_on=_words(found),
    )
    return replace(level, exceedance=better)


def _words(found: Rare) -> str:
    """Say what a rare exceedance rests on."""
    error = 100.0 * found.relative_error
    told = [f"Its Monte Carlo error is {error:.1g} %, by importance sampling"]
    if found.heavy_tailed > _TOLD:
        told.append(
            "it rests on the normal law of the scatter: by Student's t of five degrees "
            f"of freedom it were {found.heavy_tailed:.2g} times as probable"
        )
    if not 1.0 / _TOLD < found.without_prior < _TOLD:
        told.append(
            "and on the prior of the noise: without one it were "
            f"{found.without_prior:.2g} times as probable"
        )
    return "; ".join(told) + "."


def _ratio(weight: np.ndarray, values: np.ndarray) -> float:
    return float(weight @ values / weight.sum())


def pooled_rare(found: Sequence[tuple[float, Rare]]) -> Rare:
    """Return the probability over several causes.

    Args:
        found: of each cause its probability, and how rare it makes the event.
    """
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
