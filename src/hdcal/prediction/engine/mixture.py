"""Forces of a population, given the parameters: a mixture of normals.

Of the kinds of scatter those that add up are normal and exact; those that do not
(specimen, tolerances) are nodes of the mixture. Probabilities and quantiles of it are
exact, far into the tails, and differentiable.
"""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfc, ndtri
from jax.scipy.stats import norm
from jaxtyping import Float

from hdcal.data.records import Array

# What does not scatter at all still needs a width [N]: far below any reading.
_LEAST_SD = 1e-9
_MOST_STEPS = 80
# Steps of the solution below this share of the least sd are none [-].
_CLOSE = 1e-8


class Mixture(eqx.Module):
    """Normal components; leading axes, such as the draws, are a batch.

    Attributes:
        weight: of each component, sum 1.
        mean: [N].
        sd: [N].
    """

    weight: Float[Array, "*b k"]
    mean: Float[Array, "*b k"]
    sd: Float[Array, "*b k"]

    def below(self, force: Float[Array, "*b"]) -> Float[Array, "*b"]:
        """Return the share of the population whose force is at most this."""
        return self._share(force[..., None] - self.mean)

    def above(self, force: Float[Array, "*b"]) -> Float[Array, "*b"]:
        """Return the share that exceeds a force, exact where it is tiny."""
        return self._share(self.mean - force[..., None])

    def along(self, sense: Array | float) -> "Mixture":
        """Return the forces times the sense of loading, +1 or −1."""
        return replace(self, mean=sense * self.mean)

    def widened(self, sd: Array | float) -> "Mixture":
        """Return the forces plus an independent error of this sd [N]."""
        return replace(self, sd=jnp.hypot(self.sd, sd))

    def centre(self) -> Float[Array, "*b"]:
        """Return the mean force [N]."""
        return jnp.sum(self.weight * self.mean, axis=-1)

    def _share(self, room):
        sd = jnp.maximum(self.sd, _LEAST_SD)
        return jnp.sum(self.weight * _phi(room / sd), axis=-1)

    def quantile(self, share: Float[Array, "*b"] | float) -> Float[Array, "*b"]:
        """Return the force that this share does not exceed [N].

        Newton's steps inside a bracket. The last step is taken with the derivatives
        left in, which makes those of the result exact (implicit function theorem).
        """
        share = jnp.broadcast_to(jnp.asarray(share), self.mean.shape[:-1])
        still = jax.lax.stop_gradient
        fixed, share = jax.tree.map(still, self), still(share)
        place = still(_solve(fixed, share))
        _, slope = _side(fixed, place, share)
        miss = jnp.where(
            share > 0.5, (1.0 - share) - self.above(place), self.below(place) - share
        )
        return place - miss / still(slope)


def _phi(z):
    return 0.5 * erfc(-z / np.sqrt(2.0))


def _side(mixture: Mixture, force, share):
    """Return the share on the side where it is the smaller, and the density."""
    upper = share > 0.5
    flipped = jnp.where(upper, -1.0, 1.0)[..., None]

    def tail(at):
        return mixture._share(flipped * (at[..., None] - mixture.mean))

    value, slope = jax.jvp(tail, (force,), (jnp.ones_like(force),))
    return value, jnp.maximum(jnp.abs(slope), 1e-300)


def _solve(mixture: Mixture, share):
    sd = jnp.maximum(mixture.sd, _LEAST_SD)
    score = ndtri(share)
    # The quantile of a mixture lies among those of its components.
    each = mixture.mean + score[..., None] * sd
    counts = mixture.weight > 0.0
    low = jnp.min(jnp.where(counts, each, np.inf), axis=-1)
    high = jnp.max(jnp.where(counts, each, -np.inf), axis=-1)
    close = _CLOSE * jnp.min(sd, axis=-1)
    centre = mixture.centre()
    moment = mixture.weight * (sd**2 + (mixture.mean - centre[..., None]) ** 2)
    spread = jnp.sqrt(jnp.sum(moment, axis=-1))
    tail_score = -jnp.abs(score)

    def step(state):
        low, high, place, _, count = state
        tail, density = _side(mixture, place, share)
        # A nearly normal mixture is nearly straight in its scores.
        found = ndtri(jnp.clip(tail, 1e-300, 1.0 - 1e-16))
        miss = jnp.where(share > 0.5, tail_score - found, found - tail_score)
        short = miss < 0.0
        low, high = jnp.where(short, place, low), jnp.where(short, high, place)
        new = place - miss * norm.pdf(found) / density
        new = jnp.where((new > low) & (new < high), new, 0.5 * (low + high))
        moved = jnp.max(jnp.minimum(jnp.abs(new - place), high - low) / close)
        return low, high, new, moved, count + 1

    def going(state):
        *_, moved, count = state
        return (moved > 1.0) & (count < _MOST_STEPS)

    place = jnp.clip(centre + score * spread, low, high)
    start = low - close, high + close, place, jnp.asarray(np.inf), 0
    return jax.lax.while_loop(going, step, start)[2]


def pooled(parts: Sequence[tuple[Float[Array, " d"], Mixture]]) -> Mixture:
    """Return the mixture over draws, each with its weight: the predictive law.

    Args:
        parts: weights of the draws, and their mixtures with one batch axis.
    """
    weights, means, sds = [], [], []
    for share, part in parts:
        shape = part.mean.shape
        weights.append((share[:, None] * jnp.broadcast_to(part.weight, shape)).ravel())
        means.append(part.mean.ravel())
        sds.append(jnp.broadcast_to(part.sd, shape).ravel())
    return Mixture(*map(jnp.concatenate, (weights, means, sds)))


def quantile_weights(
    values: np.ndarray, weights: np.ndarray, share: float
) -> np.ndarray:
    """Return how much of each draw is in a quantile over draws.

    Args:
        values: shape (d,).
        weights: of the draws, shape (d,).
        share: of the weight below.

    Returns:
        Weights with Σ = 1 that give the quantile, between two neighbouring draws, from
        the values; also the derivative of it by each value.
    """
    order = np.argsort(values, kind="stable")
    sorted_weights = weights[order]
    places = (np.cumsum(sorted_weights) - 0.5 * sorted_weights) / np.sum(weights)
    upper = int(np.clip(np.searchsorted(places, share), 1, len(values) - 1))
    span = places[upper] - places[upper - 1]
    part = np.clip((share - places[upper - 1]) / span, 0.0, 1.0)
    used = np.zeros(len(values))
    used[order[upper]] += part
    used[order[upper - 1]] += 1.0 - part
    return used


def weighted_quantile(values: np.ndarray, weights: np.ndarray, share: float) -> float:
    """Return a quantile over draws; arguments are those of `quantile_weights`."""
    used = quantile_weights(values, weights, share)
    chosen = used > 0.0
    return float(used[chosen] @ values[chosen])


def draw_quantiles(
    values: np.ndarray, weights: np.ndarray, shares: np.ndarray
) -> np.ndarray:
    """Return quantiles over draws [d, n] at every row, shape (q, n)."""
    total, found = np.sum(weights), []
    # What lies side by side in memory is sorted six times as fast.
    for row in np.ascontiguousarray(values.T):
        order = np.argsort(row)
        own = weights[order]
        place = (np.cumsum(own) - 0.5 * own) / total
        found.append(np.interp(shares, place, row[order]))
    return np.stack(found, axis=1)
