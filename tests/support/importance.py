"""Another way to the evidence: importance sampling of the NumPyro model's density.

In coordinates in which every prior is standard normal; the proposal is a mixture of
two multivariate t laws that is fitted to its own weighted draws a few times.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import ndtr, ndtri
from scipy import optimize, stats

from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.problem import Problem

BASE = ("K", "E0", "alpha", "force_offset", "deformation_offset", "sigma")
# Degrees of freedom, spreads and weights of the proposal.
FREEDOM, SPREADS, WEIGHTS = 5.0, (1.2, 6.0), (0.8, 0.2)
ROUNDS, TRIAL, DRAWS = 6, 4000, 20_000


@dataclass(frozen=True)
class Found:
    """Log evidence, its standard error and the effective number of draws."""

    log_evidence: float
    error: float
    effective: float


def quantile(prior, z):
    """Return the prior's quantile at the probability of a standard normal."""
    first, *rest = prior.numbers
    match prior.family:
        case "fixed":
            return jnp.asarray(first) + 0.0 * z
        case "normal":
            return first + rest[0] * z
        case "lognormal":
            return first * jnp.exp(rest[0] * z)
        case "half_normal":
            return -first * ndtri(0.5 * ndtr(-z))
        case "uniform":
            return first + (rest[0] - first) * ndtr(z)
    raise ValueError(prior.family)


def sites(problem: Problem) -> list[str]:
    """Return the parameters that the likelihood of a case with one run depends on."""
    return [name for name in problem.priors if name in BASE or "." in name]


def log_joint(problem: Problem, z):
    values = {
        name: quantile(problem.priors[name], z[i])
        for i, name in enumerate(sites(problem))
    }
    prior = -0.5 * jnp.sum(z**2) - 0.5 * len(z) * jnp.log(2.0 * jnp.pi)
    return log_likelihood(problem, values) + prior


@jax.jit
def _heights(problem, table):
    return jax.lax.map(lambda z: log_joint(problem, z), table, batch_size=500)


_slope = jax.jit(jax.value_and_grad(log_joint, argnums=1))
_curve = jax.jit(jax.hessian(log_joint, argnums=1))


def _mode(problem: Problem, rng) -> tuple[np.ndarray, np.ndarray]:
    """Return the highest of a few modes and the covariance there."""
    start = rng.normal(size=(TRIAL, len(sites(problem))))
    height = np.nan_to_num(np.asarray(_heights(problem, start)), nan=-np.inf)

    def minus(z):
        value, slope = _slope(problem, z)
        return -float(np.nan_to_num(value, nan=-1e10)), -np.nan_to_num(slope)

    found = [
        optimize.minimize(minus, one, jac=True, method="BFGS", options={"maxiter": 200})
        for one in start[np.argsort(-height)[:5]]
    ]
    best = min(found, key=lambda result: result.fun).x
    strength, axes = np.linalg.eigh(-np.asarray(_curve(problem, best)))
    # A posterior is no wider than its prior, nearly.
    return best, (axes / np.maximum(strength, 1.0)) @ axes.T


def evidence(problem: Problem, seed: int = 0) -> Found:
    """Return the evidence of a problem.

    Args:
        problem: one run and one specimen, Gaussian noise.
        seed: of the draws.
    """
    rng = np.random.default_rng(seed)
    centre, spread = _mode(problem, rng)
    for turn in range(ROUNDS + 1):
        count = TRIAL if turn < ROUNDS else DRAWS
        laws = [stats.multivariate_t(centre, s * spread, FREEDOM) for s in SPREADS]
        picked = rng.random(count) < WEIGHTS[1]
        draws = np.where(
            picked[:, None],
            laws[1].rvs(count, random_state=rng),
            laws[0].rvs(count, random_state=rng),
        )
        proposal = np.logaddexp(
            *(np.log(w) + o.logpdf(draws) for w, o in zip(WEIGHTS, laws, strict=True))
        )
        height = np.asarray(_heights(problem, draws)) - proposal
        top = np.nanmax(height)
        weight = np.nan_to_num(np.exp(height - top))
        effective = weight.sum() ** 2 / np.sum(weight**2)
        # As long as few draws matter, all of them are levelled a little.
        share = weight if effective > 200.0 else weight**0.3
        share = share / share.sum()
        if turn < ROUNDS:
            centre = share @ draws
            spread = np.cov(draws.T, aweights=share) + 1e-9 * np.eye(len(centre))
    error = weight.std() / weight.mean() / np.sqrt(count)
    return Found(float(np.log(weight.mean()) + top), float(error), float(effective))
