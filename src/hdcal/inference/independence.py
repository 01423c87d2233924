"""Where a posterior is nearly normal a draw costs one density, not a trajectory.

A multivariate t proposes, wherever a chain is, and Metropolis' rule accepts: draws are
of the posterior itself, whatever proposes. The t is fitted to weighted proposals first,
in rounds. Where it covers the posterior badly nothing is returned.

Source:
    Tierney, Annals of Statistics 22 (1994), independence chains; Cappé, Guillin, Marin
    and Robert, Journal of Computational and Graphical Statistics 13 (2004), rounds;
    Vehtari et al., Journal of Machine Learning Research 25 (2024), Pareto k.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float, Key
from scipy import stats

from hdcal.data.records import Array
from hdcal.inference.diagnostics import have_mixed
from hdcal.inference.laplace import Whitening, potential, values_at
from hdcal.inference.sampled_problem import Sampled

# Tails heavier than a posterior's, which keep weights bounded.
_FREEDOM = 8
# Proposals of a round; rounds end when such a share of them is worth a draw.
_ROUNDS, _EFFICIENT = (1000, 2000, 4000), 0.4
# Independent draws that are aimed at for each draw that is kept, and proposals for it
# at most.
_WORTH, _MOST = 0.5, 8
# Least scatter of proposals, in variances at the mode.
_LEAST = 0.01
# Proposals of a chain that are left out, after which it has forgotten its start.
_FORGOTTEN = 100
# Densities between two signs of life.
_BLOCK = 500
# Pareto shape of the weights from which on proposals miss a part that counts.
MAX_SHAPE = 0.7


class IndependentDraws(NamedTuple):
    """Draws, and how well proposals covered the posterior.

    Attributes:
        values: by site name, each of shape (chain, draw).
        shape: Pareto k of the largest weights.
    """

    values: dict[str, np.ndarray]
    shape: float


def sample_independently(
    problem: Sampled,
    whitening: Whitening,
    key: Key[Array, ""],
    *,
    chains: int,
    draws: int,
    progress: Callable[[int, int], None] | None = None,
) -> IndependentDraws | None:
    """Draw from a posterior that is nearly normal in its unconstrained coordinates.

    Args:
        problem: the inference problem, with every parameter among its coordinates.
        whitening: its mode and curvature, from `laplace.fit`.
        key: source of randomness; the same key gives the same draws.
        chains: chains of draws.
        draws: kept of each chain.
        progress: called with (densities computed, densities in all).

    Returns:
        The draws; None where proposals cover the posterior badly.
    """
    rng = np.random.default_rng(np.asarray(jax.random.key_data(key)))
    law, efficiency = _adapted(problem, whitening, rng)
    if efficiency < _WORTH / _MOST:
        return None
    each = int(np.ceil(_WORTH / efficiency))
    place = _drawn(law, (chains, _FORGOTTEN + each * draws), rng)
    weight = _log_weights(problem, whitening, law, place, progress)
    shape = _pareto_shape(weight)
    if not shape <= MAX_SHAPE:
        return None
    chosen = _metropolis(weight, rng)[:, _FORGOTTEN::each]
    kept = np.take_along_axis(place, chosen[..., None], axis=1)
    named = _named(problem, whitening, kept)
    values = {name: np.asarray(value) for name, value in named.items()}
    moving = {name: v for name, v in values.items() if np.ptp(v) > 0.0}
    return IndependentDraws(values, shape) if have_mixed(moving) else None


def _adapted(problem: Sampled, whitening: Whitening, rng: np.random.Generator):
    """Return the proposals, and the share of the last ones that is worth a draw."""
    size = len(whitening.factor)
    law, efficiency = _proposals(np.zeros(size), np.eye(size)), 0.0
    for count in _ROUNDS:
        place = _drawn(law, (count, 1), rng)[:, 0]
        weight = _log_weights(problem, whitening, law, place)
        if not np.isfinite(weight).any():
            return law, 0.0
        share = np.exp(weight - np.logaddexp.reduce(weight))
        efficiency = float(1.0 / (count * np.sum(share**2)))
        law = _fitted(place, share)
        if efficiency >= _EFFICIENT:
            break
    return law, efficiency


def _metropolis(weight: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return which proposal each chain is at, as it goes by them; [chain, proposal]."""
    level = np.log(rng.random(weight.shape))
    each, at = np.arange(len(weight)), np.zeros(len(weight), int)
    path = np.empty(weight.shape, int)
    for step in range(weight.shape[1]):
        # So written a start where nothing is possible is left at once.
        moves = weight[:, step] >= weight[each, at] + level[:, step]
        path[:, step] = at = np.where(moves, step, at)
    return path


def _fitted(place: np.ndarray, share: np.ndarray):
    """Return the t with the mean and the scatter of weighted places."""
    # A few places with most of the weight would say nothing of the scatter.
    share = np.minimum(share, 1.0 / np.sqrt(len(share)))
    share /= share.sum()
    centre = share @ place
    about = (place - centre) * np.sqrt(share)[:, None]
    # One place alone has no scatter: a little of what it was proposed with.
    scatter = about.T @ about + _LEAST * np.eye(len(centre))
    return _proposals(centre, scatter * (_FREEDOM - 2) / _FREEDOM)


def _proposals(centre: np.ndarray, scatter: np.ndarray) -> Any:
    # Its stubs know of one dimension only.
    return stats.multivariate_t(centre, scatter, _FREEDOM)  # pyright: ignore[reportArgumentType]


def _pareto_shape(weight: np.ndarray) -> float:
    # Late: a finished result is read without it.
    from arviz_stats.base.array import array_stats

    # It takes log densities of readings, whose weights are their inverse.
    return float(array_stats.psislw(-weight.ravel())[1])


def _drawn(law: Any, shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Return places of two leading axes, the last one of which its law may drop."""
    return law.rvs(shape, random_state=rng).reshape(*shape, law.dim)


def _log_weights(
    problem: Sampled, whitening: Whitening, law: Any, place: np.ndarray, progress=None
) -> np.ndarray:
    """Return the log weight of each place, last axis; −∞ where no density is."""
    flat = place.reshape(-1, law.dim)
    found = []
    for start in range(0, len(flat), _BLOCK):
        block = flat[start : start + _BLOCK]
        # Blocks of one length are one program.
        padded = np.resize(block, (_BLOCK, law.dim))
        density = -np.asarray(_potentials(problem, whitening, padded))[: len(block)]
        found.append(np.where(np.isfinite(density), density, -np.inf))
        if progress is not None:
            progress(min(start + _BLOCK, len(flat)), len(flat))
    return np.concatenate(found).reshape(place.shape[:-1]) - law.logpdf(place)


@jax.jit
def _potentials(
    problem: Sampled, whitening: Whitening, standard: Float[Array, "n d"]
) -> Float[Array, " n"]:
    def one(place):
        return potential(problem, whitening.position(place))

    # One after the other: side by side many gears fill the memory.
    return jax.lax.map(one, standard)


@jax.jit
def _named(problem: Sampled, whitening: Whitening, standard: Float[Array, "c n d"]):
    def one(place):
        return values_at(problem, whitening.position(place))

    return jax.vmap(lambda chain: jax.lax.map(one, chain))(standard)


# What is compiled anew for each kind of problem.
COMPILED = (_potentials, _named)
