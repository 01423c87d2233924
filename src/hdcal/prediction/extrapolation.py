"""Bend of the force that the readings leave possible, inside and beyond their range.

The bend is a Gaussian process with free slope and curvature: an integrated plus a twice
integrated Wiener process, the laws behind cubic and quintic smoothing splines (Wahba,
J. R. Stat. Soc. B 40, 1978). It starts at the far end of the tested range. What a
straight line absorbs is removed, because offset and stiffness already carry it. Its
size is inferred from the residuals of the readings.
"""

from dataclasses import dataclass

import numpy as np
from jax import jit
from scipy.special import softmax

from hdcal.data.records import Records
from hdcal.inference.force_model.likelihood import row_precision
from hdcal.inference.force_model.padding import pad_records
from hdcal.inference.force_model.problem import Problem
from hdcal.inference.force_model.values import Values, predict_rows, with_rounding
from hdcal.inference.posterior import Posterior

# Sizes of the bend as shares of the force range, sds of noise as shares of that of the
# residuals. A size above ORDINARY is less probable: in the prior tables the stiffness
# changes by some 20 % over the range.
SIZES, ORDINARY = np.geomspace(1e-3, 3.0, 14), 0.1
NOISES = np.geomspace(0.1, 1.2, 10)
# Residuals are averaged at so many places.
KNOTS = 48
# Part of the tested range over which the bend takes the place of a fitted discrepancy.
FADE = 0.03
# Least sd of the noise as a share of the force range: readings may have been computed;
# and the least such range [N], where they show none.
LEAST_NOISE, LEAST_RANGE = 1e-6, 1e-9


@dataclass(frozen=True)
class Bend:
    """The bend that grows from the far end of the tested deformation to and beyond one.

    Residuals are at k knots, 0 at the far end and 1 at the end. The line has the weight
    of each in offset and stiffness, (2, k); along m axes no line absorbs them, (k, m):
    there they are `found` [N], (m,), with a variance under each of g laws [N²], (m, g).
    """

    end: float
    far: float
    knots: np.ndarray
    line: np.ndarray
    axes: np.ndarray
    found: np.ndarray
    size: np.ndarray
    variance: np.ndarray
    chances: np.ndarray

    def place(self, deformation: np.ndarray) -> np.ndarray:
        """Return 0 at the far end of the tested range, 1 at the end [-]."""
        return (np.asarray(deformation) - self.far) / (self.end - self.far)

    def beyond(self, deformation: np.ndarray) -> np.ndarray:
        """Return the share of a fitted discrepancy that the bend replaces [-]."""
        over = np.maximum(self.place(deformation) - 1.0, 0.0) / FADE
        return -np.expm1(-(over**2))

    def law(self, deformation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and sd of the bend under each law at places [N], (g, n) each."""
        at = np.maximum(self.place(deformation), 0.0)
        lines = np.stack([np.ones_like(at), at], axis=1) @ self.line
        to_knots = covariance(at, self.knots)
        among = covariance(self.knots, self.knots)
        cross = (to_knots - lines @ among) @ self.axes
        prior = covariance(at, at, pairs=False)
        prior += np.sum(lines * (lines @ among - 2.0 * to_knots), axis=1)
        square = self.size[:, None] ** 2
        mean = square * ((self.found / self.variance.T) @ cross.T)
        taken = square * ((1.0 / self.variance.T) @ (cross.T**2))
        return mean, np.sqrt(np.maximum(square * (prior - taken), 0.0))

    def of_draws(
        self, deformation: np.ndarray, level: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and sd of the bend of each draw [N], (d, n), by a level, (d,)."""
        mean, sd = self.law(deformation)
        law = np.searchsorted(np.cumsum(self.chances)[:-1], level)
        return mean[law], sd[law]


def fit_bends(posterior: Posterior) -> tuple[Bend, Bend]:
    """Return the bends towards the low and the high end of the tested deformation."""
    records = posterior.case.records
    middle = {name: values.mean(axis=0) for name, values in posterior.draws.items()}
    middle.pop("gap_weights", None)
    padded = pad_records(records)
    residual, precision = (
        np.asarray(column)[: len(records.force)]
        for column in _residuals(posterior.problem, middle, padded)
    )
    deformation = np.asarray(records.deformation)
    low, high = float(deformation.min()), float(deformation.max())
    change = max(abs(float(middle["stiffness"]) * (high - low)), LEAST_RANGE)
    precision = np.nan_to_num(precision, nan=np.inf)
    precision = np.minimum(precision, (LEAST_NOISE * change) ** -2)
    rows = deformation, residual, precision / precision.mean(), change
    return _fitted(low, high, *rows), _fitted(high, low, *rows)


def _fitted(end: float, far: float, deformation, residual, weight, change) -> Bend:
    place, rows = (deformation - far) / (end - far), len(residual)
    _, knot = np.unique(np.round(place * (KNOTS - 1)), return_inverse=True)
    total = np.bincount(knot, weight)
    knots, mean = (
        np.bincount(knot, weight * column) / total for column in (place, residual)
    )
    within = weight @ (residual - mean[knot]) ** 2
    # Directions of the weighted residuals that no straight line absorbs.
    root = np.sqrt(total)
    columns = np.stack([np.ones_like(knots), knots], axis=1)
    line = np.linalg.pinv(root[:, None] * columns) * root
    off = root[:, None] * (np.eye(len(root)) - columns @ line)
    strength, axes = np.linalg.eigh(off @ covariance(knots, knots) @ off.T)
    axes, strength = off.T @ axes[:, 2:], np.maximum(strength[2:], 0.0)
    found = axes.T @ mean
    left = np.sqrt((found @ found + within) / max(rows - 2, 1))
    size, noise = (
        grid.ravel()
        for grid in np.meshgrid(
            change * SIZES, np.maximum(left, LEAST_NOISE * change) * NOISES
        )
    )
    variance = size**2 * strength[:, None] + noise**2
    misfit = np.sum(np.log(variance) + found[:, None] ** 2 / variance, axis=0)
    unusual = np.log(np.maximum(size / (ORDINARY * change), 1.0))
    log_chance = -0.5 * (misfit + within / noise**2 + unusual**2)
    log_chance -= (rows - len(knots)) * np.log(noise)
    return Bend(end, far, knots, line, axes, found, size, variance, softmax(log_chance))


def covariance(one: np.ndarray, other: np.ndarray, *, pairs: bool = True) -> np.ndarray:
    """Return the covariance of a bend of size 1 between places (k,) and (n,).

    Between all pairs, (k, n), or of the i-th with the i-th, (k,).
    """
    one = one[:, None] if pairs else one
    low, high = np.minimum(one, other), np.maximum(one, other)
    once = low**2 * (high / 2.0 - low / 6.0)
    return once + low**3 * (high**2 / 12.0 - low * high / 24.0 + low**2 / 120.0)


@jit
def _residuals(problem: Problem, values: Values, records: Records):
    """Return residuals without the discrepancy [N], and the precision of each row."""
    mean, noise = predict_rows(problem, values, records, None)
    residual = records.force - mean
    return residual, row_precision(residual, with_rounding(noise, problem.step))
