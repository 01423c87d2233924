"""Where a posterior has a few parameters a draw costs one density, no trajectory.

A mixture of multivariate t laws proposes, wherever a chain is, and Metropolis' rule
accepts: draws are of the posterior itself, whatever proposes. The mixture is fitted to
all proposals so far, weighted, in rounds; a wide part of it finds what others miss.
Where it covers the posterior badly nothing is returned.

Source:
    Tierney, Annals of Statistics 22 (1994), independence chains; Cornuet, Marin, Mira
    and Robert, Scandinavian Journal of Statistics 39 (2012), rounds whose proposals all
    count; Cappé, Douc, Guillin, Marin and Robert, Statistics and Computing 18 (2008),
    mixtures; Vehtari et al., Journal of Machine Learning Research 25 (2024), Pareto k.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.exported import jit
from hdcal.inference.laplace import Whitening, potential, values_at
from hdcal.inference.mixing import have_mixed, pareto_shape
from hdcal.inference.sampled_problem import Sampled
from hdcal.inference.t_mixture import TMixture, first_mixture, fitted_mixture

# Proposals of a round; rounds end when such a share of the last ones is worth a draw.
_ROUNDS, _EFFICIENT, _LIGHT = (1000, 2000, 4000, 4000), 0.4, 0.5
# Independent draws aimed at first for each draw that is kept, and proposals for it at
# most.
_WORTH, _MOST = 0.5, 12
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
    seed: int,
    *,
    chains: int,
    draws: int,
    progress: Callable[[int, int], None] | None = None,
) -> IndependentDraws | None:
    """Draw from a posterior that is a few parameters, in its unconstrained coordinates.

    Args:
        problem: the inference problem, with every parameter among its coordinates.
        whitening: its mode and curvature, from `laplace.fit`.
        seed: the same one gives the same draws.
        chains: chains of draws.
        draws: kept of each chain.
        progress: called with (densities computed, densities in all).

    Returns:
        The draws; None where proposals cover the posterior badly.
    """
    rng = np.random.default_rng(np.asarray(_entropy(seed)))
    law, efficiency = _adapted(problem, whitening, rng)
    if efficiency < 1.0 / _MOST:
        return None
    each = max(1, round(_WORTH / efficiency))
    place = np.empty((chains, 0, len(whitening.factor)))
    weight = np.empty((chains, 0))
    while each <= _MOST:
        length = _FORGOTTEN + each * draws - weight.shape[1]
        flat = law.draw(chains * length, rng)
        density = _log_densities(problem, whitening, flat, progress)
        new = (density - law.log_density(flat)).reshape(chains, length)
        weight = np.concatenate([weight, new], axis=1)
        place = np.concatenate([place, flat.reshape(chains, length, -1)], axis=1)
        shape = pareto_shape(_shares(weight.ravel()))
        if not shape <= MAX_SHAPE:
            return None
        chosen = _metropolis(weight, rng)[:, _FORGOTTEN::each]
        kept = np.take_along_axis(place, chosen[..., None], axis=1)
        named = _named(problem, whitening, kept)
        values = {name: np.asarray(value) for name, value in named.items()}
        if have_mixed({name: v for name, v in values.items() if np.ptp(v) > 0.0}):
            return IndependentDraws(values, shape)
        # They cover it, and are too few.
        each *= 2
    return None


@jit
def _entropy(seed: int):
    """Return the key from which `sample` draws too, as numbers."""
    return jax.random.key_data(jax.random.split(jax.random.key(seed))[0])


def _adapted(
    problem: Sampled, whitening: Whitening, rng: np.random.Generator
) -> tuple[TMixture, float]:
    """Return the proposals, and the share of the last ones that is worth a draw."""
    law = first_mixture(len(whitening.factor))
    laws, places, densities, efficiency = [], [], [], 0.0
    for count in _ROUNDS:
        laws.append((count, law))
        places.append(law.draw(count, rng))
        densities.append(_log_densities(problem, whitening, places[-1]))
        weight = densities[-1] - law.log_density(places[-1])
        if not np.isfinite(weight).any():
            return law, 0.0
        efficiency = 1.0 / (count * np.sum(_shares(weight) ** 2))
        place, total = np.concatenate(places), sum(many for many, _ in laws)
        # As if each had been drawn from all of the laws so far.
        each = [np.log(many / total) + one.log_density(place) for many, one in laws]
        share = _shares(np.concatenate(densities) - np.logaddexp.reduce(each))
        law = fitted_mixture(place, share, rng)
        if efficiency >= _EFFICIENT and pareto_shape(_shares(weight.ravel())) <= _LIGHT:
            break
    return law, float(efficiency)


def _shares(log_weight: np.ndarray) -> np.ndarray:
    return np.exp(log_weight - np.logaddexp.reduce(log_weight))


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


def _log_densities(
    problem: Sampled, whitening: Whitening, place: np.ndarray, progress=None
) -> np.ndarray:
    """Return the log density at each place, shape (n, d); −∞ where there is none."""
    found = []
    for start in range(0, len(place), _BLOCK):
        block = place[start : start + _BLOCK]
        # Blocks of one length are one program.
        padded = np.resize(block, (_BLOCK, place.shape[1]))
        density = -np.asarray(_potentials(problem, whitening, padded))[: len(block)]
        found.append(np.where(np.isfinite(density), density, -np.inf))
        if progress is not None:
            progress(min(start + _BLOCK, len(place)), len(place))
    return np.concatenate(found)


@jit
def _potentials(
    problem: Sampled, whitening: Whitening, standard: Float[Array, "n d"]
) -> Float[Array, " n"]:
    def one(place):
        return potential(problem, whitening.position(place))

    # One after the other: side by side many gears fill the memory.
    return jax.lax.map(one, standard)


@jit
def _named(problem: Sampled, whitening: Whitening, standard: Float[Array, "c n d"]):
    def one(place):
        return values_at(problem, whitening.position(place))

    return jax.vmap(lambda chain: jax.lax.map(one, chain))(standard)
