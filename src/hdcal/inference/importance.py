"""Importance sampling of a posterior with few parameters: a draw costs one density.

Three multivariate t distributions propose, of one centre and increasing width. In
rounds they take mean and covariance of the weighted proposals; then proposals are
resampled (Cappé et al., Journal of Computational and Graphical Statistics 13, 2004;
Pareto k: Vehtari et al., Journal of Machine Learning Research 25, 2024).
"""

from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp, softmax
from scipy.stats import multivariate_t

from hdcal.data.records import Array
from hdcal.inference.diagnostics import pareto_shape
from hdcal.inference.laplace import Whitening, potential, values_at
from hdcal.inference.sample import Progress
from hdcal.inference.sampled_problem import Sampled

# Largest Pareto k of weights whose proposals cover the posterior.
MAX_SHAPE = 0.7
# Degrees of freedom: tails heavier than a posterior's, which keep weights bounded.
_FREEDOM = 8.0
# Shares of the distributions, and their widths in that of the weighted proposals: the
# widest one reaches tails that fall off exponentially.
_SHARES, _WIDTHS = np.array([0.65, 0.25, 0.1]), np.array([1.0, 1.7, 3.5])
# Least variance of the narrow one, in variances at the mode.
_LEAST_VARIANCE = 0.01
# Proposals of each round, and the efficiency and Pareto k at which rounds end.
_ROUNDS, _EFFICIENT, _LIGHT = (1000, 2000, 4000, 4000), 0.4, 0.5
# Most proposals for each draw that is kept.
_MOST = 12
# Densities between two calls of `progress`.
_BLOCK = 500


class Proposals(NamedTuple):
    """Multivariate t distributions about one centre, with the narrowest's scale."""

    centre: np.ndarray
    covariance: np.ndarray

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return places, shape (count, d)."""
        step = self._t(1.0).rvs(count, rng).reshape(count, -1) - self.centre
        width = rng.choice(_WIDTHS, count, p=_SHARES)
        return self.centre + width[:, None] * step

    def log_density(self, place: np.ndarray) -> np.ndarray:
        """Return the log density at each place, shape (n, d)."""
        each = [self._t(width).logpdf(place) for width in _WIDTHS]
        return np.asarray(logsumexp(each, axis=0, b=_SHARES[:, None]))

    def _t(self, size: float) -> Any:
        scale: Any = size**2 * self.covariance
        return multivariate_t(self.centre, scale, _FREEDOM)  # pyright: ignore


class ImportanceDraws(NamedTuple):
    """Resampled draws by site name, (chain, draw) each, and Pareto k of the weights."""

    values: dict[str, np.ndarray]
    shape: float


def sample_by_importance(
    problem: Sampled,
    whitening: Whitening,
    seed: int,
    *,
    chains: int,
    draws: int,
    progress: Progress | None = None,
) -> ImportanceDraws | None:
    """Draw from a posterior with few parameters; None where proposals cover it badly.

    The effective sample size of the proposals is at least half the number of draws.
    Parameters as of `sample`; `progress` is called with numbers of densities.
    """
    rng, kept = np.random.default_rng(seed), chains * draws
    proposals, efficiency = _adapted(problem, whitening, rng)
    if efficiency < 1.0 / _MOST:
        return None
    place = proposals.draw(int(kept / efficiency), rng)
    weight = _weights(problem, whitening, proposals, place, progress)
    shape = pareto_shape(weight)
    if not shape <= MAX_SHAPE or 1.0 / np.sum(weight**2) < 0.5 * kept:
        return None
    # Systematic resampling: a place is kept as often as its weight has it, ± 1.
    level = (np.arange(kept) + rng.random()) / kept
    chosen = np.searchsorted(np.cumsum(weight), level).clip(max=len(place) - 1)
    standard = place[rng.permutation(chosen)].reshape(chains, draws, -1)
    return ImportanceDraws(jax.device_get(_named(problem, whitening, standard)), shape)


def _adapted(
    problem: Sampled, whitening: Whitening, rng: np.random.Generator
) -> tuple[Proposals, float]:
    """Return proposals, and the effective sample size for each of the last ones."""
    size, efficiency = len(whitening.factor), 0.0
    proposals = Proposals(np.zeros(size), np.eye(size))
    for count in _ROUNDS:
        place = proposals.draw(count, rng)
        weight = _weights(problem, whitening, proposals, place)
        if not np.isfinite(weight).all():
            return proposals, 0.0
        efficiency = 1.0 / (count * np.sum(weight**2))
        if efficiency >= _EFFICIENT and pareto_shape(weight) <= _LIGHT:
            break
        # A few places with most of the weight would decide mean and covariance.
        share = np.minimum(weight, 1.0 / np.sqrt(count))
        share /= share.sum()
        covariance = np.cov(place.T, aweights=share, ddof=0).reshape(size, size)
        covariance += _LEAST_VARIANCE * np.eye(size)
        proposals = Proposals(share @ place, covariance)
    return proposals, float(efficiency)


def _weights(
    problem: Sampled,
    whitening: Whitening,
    proposals: Proposals,
    place: np.ndarray,
    progress: Progress | None = None,
) -> np.ndarray:
    """Return the importance weight of each place, shape (n, d); they sum to 1."""
    density = np.empty(len(place))
    for start in range(0, len(place), _BLOCK):
        block = place[start : start + _BLOCK]
        # Blocks of one length are one program.
        padded = np.resize(block, (_BLOCK, place.shape[1]))
        log_density = -np.asarray(_potentials(problem, whitening, padded))
        density[start : start + _BLOCK] = log_density[: len(block)]
        if progress is not None:
            progress(start + len(block), len(place))
    density = np.where(np.isfinite(density), density, -np.inf)
    return softmax(density - proposals.log_density(place))


@jax.jit
def _potentials(
    problem: Sampled, whitening: Whitening, standard: Float[Array, "n d"]
) -> Float[Array, " n"]:
    # One after the other: side by side many gears fill the memory.
    return jax.lax.map(
        lambda place: potential(problem, whitening.position(place)), standard
    )


@jax.jit
def _named(problem: Sampled, whitening: Whitening, standard: Float[Array, "c n d"]):
    def values(place):
        return values_at(problem, whitening.position(place))

    return jax.vmap(lambda group: jax.lax.map(values, group))(standard)
