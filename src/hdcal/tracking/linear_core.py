"""The linear model updated row by row: exact, and in constant memory.

What is known is kept as the mean m of the coefficients and a square root A of their
covariance over σ², which each row updates by Potter's formula (Kaminski, Bryson and
Schmidt, IEEE Trans. Autom. Control 16, 1971). Unlike an update of the covariance itself
this keeps its digits when rows hardly differ from each other.

Arrays have leading axes "...": none for one core, one for many cores side by side.
"""

from dataclasses import replace
from typing import Self

import numpy as np
from scipy.linalg.lapack import (
    dpotrf,  # pyright: ignore[reportAttributeAccessIssue]
    dtrtrs,  # pyright: ignore[reportAttributeAccessIssue]
)

from hdcal.tracking.normal_inverse_gamma import (
    NormalInverseGamma,
    half_width,
    normal_score,
    student_sd,
)

# Where they stand among the coefficients.
STIFFNESS, ZERO = 0, 2
# What is forgotten fades to the prior with its sds this many times as wide: a gear
# that has changed is not held to what it was.
_FADED = 10.0


class LinearCores:
    """Knowledge of linear coefficients and noise, of one core or of many.

    Args:
        prior: what is known before the first row.

    Attributes:
        prior: what was known before the first row.
        mean: m, shape (..., p).
        root: A, shape (..., p, r).
        shape: a of the noise variance [-].
        rate: b of the noise variance [N²], shape (...).
    """

    def __init__(self, prior: NormalInverseGamma):
        axes = np.broadcast_shapes(prior.mean.shape, prior.root.shape[:-1])
        # In Fortran's order the numbers of many cores lie side by side in memory, which
        # makes arithmetic on them twice as fast.
        self.mean = np.broadcast_to(prior.mean, axes).copy("F")
        root = np.broadcast_to(prior.root, (*axes, prior.root.shape[-1]))
        self.root = root.copy("F")
        self.shape, self.rate = prior.shape, prior.rate
        self.prior, self._inverse = prior, np.linalg.pinv(prior.root)

    def learn(self, columns: np.ndarray, force: float, weight: float = 1.0):
        """Predict a row from the rows before it, then learn from it.

        Args:
            columns: x, shape (p,) or (..., p).
            force: reading y [N].
            weight: of what the row says, 0 to 1.

        Returns:
            Median [N], scale [N] and degrees of freedom of the predictive
            distribution, a Student one.
        """
        spread = np.vecmat(columns, self.root, order="F")
        wide = 1.0 + np.vecdot(spread, spread)
        expected = np.vecdot(columns, self.mean)
        error = force - expected
        scale, freedom = (self.rate / self.shape * wide) ** 0.5, 2.0 * self.shape
        if weight > 0.0:
            self._gain(spread, error, 1.0 / weight)
        self.shape += 0.5 * weight
        self.rate = self.rate + 0.5 * weight * error * error / wide
        return expected, scale, freedom

    def _gain(self, spread: np.ndarray, error, noise: float) -> None:
        """Update the coefficients by Potter's formula.

        Args:
            spread: Aᵀx, shape (..., r).
            error: of the row [N].
            noise: its variance over σ².
        """
        wide = noise + np.vecdot(spread, spread)
        gain = np.matvec(self.root, spread, order="F")
        self.mean += gain * (error / wide)[..., None]
        spread = spread / (wide + (noise * wide) ** 0.5)[..., None]
        self.root -= gain[..., :, None] * spread[..., None, :]

    def add_unknowns(self, count: int) -> None:
        """Let rows have more columns at their end, of independent unknowns N(0, 1).

        Args:
            count: of the columns.
        """
        own = np.eye(count) / np.sqrt(self.rate / self.shape)[..., None, None]
        prior = self.prior
        self.mean = _longer(self.mean, count)
        self.root = np.asfortranarray(_beside(self.root, own))
        mean, root = _longer(prior.mean, count), _beside(prior.root, own)
        self.prior = replace(prior, mean=mean, root=root)
        self._inverse = np.linalg.pinv(root)

    def slower(self) -> Self:
        """Return what follows the noise of the last rows less: itself."""
        return self

    def marginal(self, index: int):
        """Return median, scale and degrees of freedom of a coefficient."""
        part = self.root[..., index, :]
        scale = (self.rate / self.shape * np.vecdot(part, part)) ** 0.5
        return self.mean[..., index], scale, 2.0 * self.shape

    def widen(self, index: int, variance: float) -> None:
        """Add variance to one coefficient: it may have moved since the last row.

        Args:
            index: of the coefficient.
            variance: to add, in the square of its unit.
        """
        ratio = np.asarray(variance / (self.rate / self.shape))[..., None, None]
        # Over the prior's root: what the prior took as known stays so.
        relative = self._inverse @ self.root
        added = np.sqrt(ratio) * self._inverse[..., index, None]
        added = np.broadcast_to(added, (*relative.shape[:-1], 1))
        wider = np.linalg.qr(np.concatenate([relative, added], axis=-1).mT).R.mT
        self.root = self.prior.root @ wider


class LinearCore(LinearCores):
    """Knowledge of the linear coefficients of one core, which may forget.

    Args:
        prior: what is known before the first row.
        forget: share λ of what is known that is kept at each new row; below 1 the
            knowledge is tempered towards a prior ten times as wide, p ← p^λ · p₀^(1−λ)
            (stabilised forgetting, Kulhavý and Zarrop 1993).
    """

    def __init__(self, prior: NormalInverseGamma, forget: float = 1.0):
        super().__init__(prior)
        self._forget, self._kept = forget, forget * np.eye(prior.root.shape[1])
        self._faded = self._inverse / _FADED

    def add_unknowns(self, count: int) -> None:
        """Let rows have more columns at their end, of independent unknowns N(0, 1).

        What is forgotten of these fades to what they began with, and no wider.

        Args:
            count: of the columns.
        """
        super().add_unknowns(count)
        self._kept = self._forget * np.eye(self.root.shape[1])
        self._faded = self._inverse / np.append(
            np.full(len(self.mean) - count, _FADED), np.ones(count)
        )

    def step(
        self, columns: np.ndarray, force: float, weight: float = 1.0
    ) -> tuple[float, float, float]:
        """Predict a row from the rows before it, then learn from it.

        Args:
            columns: x, shape (p,).
            force: reading y [N].
            weight: of what the row says, 0 to 1.

        Returns:
            Median [N] and half-width of the 95 % interval [N] of the predictive
            distribution, and the normal score of the reading in it.
        """
        self.fade()
        expected, scale, freedom = map(float, self.learn(columns, force, weight))
        score = normal_score((force - expected) / scale, freedom)
        return expected, scale * half_width(freedom), score

    def variance(self) -> float:
        """Return that of a reading, its coefficients known [N²]."""
        return float(self.rate / self.shape)

    def expect(self, columns: np.ndarray) -> float:
        """Return the force that the coefficients give at a row [N]."""
        return float(columns @ self.mean)

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        middle, scale, freedom = map(float, self.marginal(index))
        return middle, student_sd(scale, freedom), scale * half_width(freedom)

    def slower(self) -> Self:
        """Return one that forgets a tenth as fast; itself if it forgets nothing."""
        if self._forget == 1.0:
            return self
        return type(self)(self.prior, self._forget**0.1)

    def fade(self) -> None:
        """Temper towards the wide prior: add a part of the first prior's precision."""
        keep, prior = self._forget, self.prior
        if keep == 1.0:
            return
        relative = self._faded @ self.root
        precision = (1.0 - keep) * (relative.T @ relative) + self._kept
        # LAPACK itself: on these sizes NumPy's wrappers take ten times as long.
        factor, _ = dpotrf(precision, lower=1)
        self.root = dtrtrs(factor, self.root.T, lower=1)[0].T
        away = (1.0 - keep) * (prior.mean - self.mean) @ self._faded.T
        self.mean += away @ (self._faded @ self.root) @ self.root.T
        self.shape = keep * self.shape + (1.0 - keep) * prior.shape
        self.rate = keep * self.rate + (1.0 - keep) * prior.rate


def _longer(mean: np.ndarray, count: int) -> np.ndarray:
    return np.concatenate([mean, np.zeros((*mean.shape[:-1], count))], axis=-1)


def _beside(root: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return the root of a covariance with independent coefficients beside it."""
    axes = np.broadcast_shapes(root.shape[:-2], own.shape[:-2])
    (p, r), q = root.shape[-2:], own.shape[-1]
    found = np.zeros((*axes, p + q, r + q))
    found[..., :p, :r], found[..., p:, r:] = root, own
    return found
