"""The leftover beyond the tested deformation: how far a bend that nobody saw may grow.

It is a Gaussian process with a free slope and curvature, fitted to what the straight
model leaves of the tested rows: an integrated and a twice integrated Wiener process,
the laws behind cubic and quintic smoothing splines (Wahba, Journal of the Royal
Statistical Society B 40, 1978). What stiffness and zero absorb is taken off it. It
starts at the far end of the tested range, so that its size at this end is learned.
"""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.special import softmax

from hdcal.data.records import Array, Records
from hdcal.exported import jit
from hdcal.inference.likelihood import row_precision
from hdcal.inference.padding import pad_records
from hdcal.inference.problem import Problem
from hdcal.inference.values import Values, predict_rows, with_rounding
from hdcal.prediction.engine.causes import Cause

# Rows nearer to each other than this part of the range are one: the bend is smooth.
_KNOTS = 48
# Size of the bend over the change of force in the tested range: its logarithm is flat
# up to a tenth, as in prior tables the stiffness over a range changes by some 20 %.
_SIZES, _ORDINARY = np.geomspace(1e-3, 3.0, 14), 0.1
# Noise over what the line leaves: a bend that is there is part of that.
_NOISES = np.array([0.4, 0.55, 0.7, 0.85, 1.0, 1.15])
# The least noise over the change of force, and the least such change [N].
_LEAST_NOISE, _LEAST = 1e-6, 1e-9
# Beyond the tested range the bend comes in over this part of it.
_FADE = 0.1
_POWERS = np.arange(3)[:, None, None]


class Growth(eqx.Module):
    """What the tested rows say of a bend beyond one of their ends.

    Attributes:
        end: of the tested deformation, beyond which it grows [mm].
        far: its other end [mm].
        ties: covariance of a bend of size 1 with independent directions of the rows,
            coefficients of 1, t and t², with t = 1 at the end and 0 at the far one.
        line: what the line takes off its variance, by products of 1, t and t².
        strength: variance of a bend of size 1 in these directions.
        found: what the model leaves there [N].
    """

    end: Float[Array, ""] | float
    far: Float[Array, ""] | float
    ties: Float[Array, "3 k"]
    line: Float[Array, "3 3"]
    strength: Float[Array, " k"]
    found: Float[Array, " k"]

    def beyond(self, deformation) -> Float[Array, " n"]:
        """Return the distance beyond the end as a share of the tested range [-]."""
        place = (jnp.asarray(deformation) - self.far) / (self.end - self.far)
        return jnp.maximum(place - 1.0, 0.0)

    def share(self, deformation) -> Float[Array, " n"]:
        """Return how much of the bend is in: none where it was tested."""
        return -jnp.expm1(-((self.beyond(deformation) / _FADE) ** 2))

    def of_size(self, size, noise) -> "BendLaw":
        """Return the law of a bend of this size [N], with the noise that goes with it.

        Args:
            size: of the bend [N].
            noise: sd of a reading that goes with it [N].
        """
        return BendLaw(self, size, *self.given(size, noise))

    def given(self, size, noise):
        """Return what the rows say of a bend, by 1, t and t².

        Args:
            size: of the bend [N].
            noise: sd of a reading that goes with it [N].

        Returns:
            Its mean, (3,) [N], and by their products what a bend of size 1 has less of
            variance, (3, 3).
        """
        spread = size**2 * self.strength + noise**2
        found = size**2 * (self.ties @ (self.found / spread))
        return found, self.line + size**2 * (self.ties / spread) @ self.ties.T


class BendLaw(eqx.Module):
    """The law of a bend of known size beyond one end.

    Attributes:
        growth: what the rows say of a bend there.
        size: of the bend [N].
        found: its mean, by 1, t and t² [N].
        known: by their products, what a bend of size 1 has less of variance.
    """

    growth: Growth
    size: Float[Array, ""] | float
    found: Float[Array, " 3"]
    known: Float[Array, "3 3"]

    def at(self, deformation):
        """Return mean and sd of the bend [N], and how much of it is in [-]; each (n,).

        Args:
            deformation: as read [mm], shape (n,).
        """
        t = 1.0 + self.growth.beyond(deformation)
        # Not as matrices: small ones of many draws are slow to multiply.
        taken = sum(self.known[i, j] * t ** (i + j) for i in range(3) for j in range(3))
        mean = sum(self.found[i] * t**i for i in range(3))
        # The root of zero has no derivative.
        sd = self.size * jnp.sqrt(jnp.maximum(_variance(t) - taken, 0.0) + 1e-24)
        return mean, sd, self.growth.share(deformation)


def _variance(place):
    """Return the variance of a bend of size 1 at places."""
    return place**3 / 3.0 + place**5 / 20.0


def bend_covariance(place: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the covariance of a bend of size 1 between places, (k, n)."""
    least = np.minimum(place[:, None], other)
    later = np.maximum(place[:, None], other)
    return np.sum(later**_POWERS * _with_later(least), axis=0)


def _with_later(place: np.ndarray) -> np.ndarray:
    """Return the covariance with a later place t: coefficients of 1, t and t²."""
    none = place**5 / 120.0 - place**3 / 6.0
    return np.stack([none, place**2 / 2.0 - place**4 / 24.0, place**3 / 12.0])


@dataclass(frozen=True)
class FittedGrowth:
    """A bend beyond one end, and how large it may be.

    Attributes:
        growth: by its size and noise.
        pairs: sizes of the bend and the noise that goes with each [N], (g, 2).
        chances: of the pairs, (g,).
    """

    growth: Growth
    pairs: np.ndarray
    chances: np.ndarray

    def drawn(self, levels: np.ndarray) -> np.ndarray:
        """Return the pairs at levels from 0 to 1, by size; shape (d, 2)."""
        rows = np.searchsorted(np.cumsum(self.chances)[:-1], levels, side="right")
        return self.pairs[rows]


def fit_growths(cause: Cause) -> tuple[FittedGrowth, FittedGrowth]:
    """Fit the bends below and above the tested deformation.

    Args:
        cause: whose model leaves something of the tested rows.
    """
    records = cause.posterior.case.records
    middle = {n: v.mean(axis=0) for n, v in cause.values.items() if n != "gap_weights"}
    error, precision = (
        np.asarray(column)[: len(records.force)]
        for column in _left(cause.problem, middle, pad_records(records))
    )
    deformation = np.asarray(records.deformation)
    low, high = float(deformation.min()), float(deformation.max())
    # Readings may have been computed, and a file may say that they have no noise.
    change = max(abs(float(middle["stiffness"]) * (high - low)), _LEAST)
    precision = np.nan_to_num(precision, nan=np.inf)
    precision = np.minimum(precision, (_LEAST_NOISE * change) ** -2)
    rows = deformation, precision / precision.mean(), error, change
    return _fitted(low, high, *rows), _fitted(high, low, *rows)


def _fitted(end: float, far: float, deformation, weight, error, change) -> FittedGrowth:
    """Fit the bend beyond one end to what is left of the rows [N]."""
    place = (deformation - far) / (end - far)
    knots, total, mean, within = _knots(place, weight, error)
    lines, root = np.stack([np.ones(_KNOTS), knots], axis=1), np.sqrt(total)
    line = np.linalg.pinv(root[:, None] * lines) * root
    bent = root[:, None] * (np.eye(_KNOTS) - lines @ line)
    covariance = bend_covariance(knots, knots)
    strength, axes = np.linalg.eigh(bent @ covariance @ bent.T)
    seen, strength = axes.T @ bent, np.maximum(strength, 0.0)
    found, cross = seen @ mean, _with_later(knots)
    line = np.pad(line, ((0, 1), (0, 0)))
    left = cross - line @ covariance
    growth = Growth(end, far, left @ seen.T, (cross + left) @ line.T, strength, found)
    free = max(int(np.count_nonzero(total)) - 2, 0)
    used = slice(_KNOTS - free, None)
    pairs, chances = _sizes(strength[used], found[used], within, len(error), change)
    return FittedGrowth(growth, pairs, chances)


@jit
def _left(problem: Problem, values: Values, records: Records):
    """Return what a straight model leaves of each row [N], and its precision."""
    mean, noise = predict_rows(problem, values, records, None)
    error = records.force - mean
    return error, row_precision(error, with_rounding(noise, problem.step))


def _knots(place, weight, error):
    """Return places, weights and means of rows that are near, padded; and what is left.

    The rest is the weighted sum of squares about the means [N²].
    """
    near = np.round(place * (_KNOTS - 1)).astype(int)
    total = np.bincount(near, weight, minlength=_KNOTS)
    safe = np.where(total > 0.0, total, 1.0)
    knots, mean = (
        np.bincount(near, weight * column, minlength=_KNOTS) / safe
        for column in (place, error)
    )
    return knots, total, mean, float(weight @ (error - mean[near]) ** 2)


def _sizes(strength, found, within: float, rows: int, change: float):
    """Return sizes of the bend and noises [N], and how probable each pair is."""
    left = np.sqrt((found @ found + within) / max(rows - 2, 1))
    noises = max(left, _LEAST_NOISE * change) * _NOISES
    size, noise = (
        grid.ravel() for grid in np.meshgrid(change * _SIZES, noises, indexing="ij")
    )
    spread = size[:, None] ** 2 * strength + noise[:, None] ** 2
    log_chance = -0.5 * np.sum(np.log(spread) + found**2 / spread, axis=1)
    rest = max(rows - 2 - len(found), 0)
    log_chance -= rest * np.log(noise) + 0.5 * within / noise**2
    unusual = np.log(np.maximum(size / (_ORDINARY * change), 1.0))
    return np.stack([size, noise], axis=1), softmax(log_chance - 0.5 * unusual**2)
