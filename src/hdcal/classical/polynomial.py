"""Least-squares polynomials with standard errors, tests of fit and held-out errors.

Confidence intervals assume that the curve is right and that the errors of the rows are
independent, normal and of equal size.

Source:
    Draper and Smith, Applied Regression Analysis; Hurvich and Tsai (1989) for AICc.
"""

from typing import Literal

import numpy as np
from scipy import stats
from scipy.linalg import solve_triangular

from hdcal.report.item import INTERVAL, Draws, Item, quantity

# A smaller p value counts as lack of fit.
SIGNIFICANCE = 0.05
# Rows that are left out must leave at least this share of every direction of the curve.
_LEAST_LEFT = 1e-12
# By their powers.
_TERMS = (
    *("c", "a ω", "b ω²", "d ω³", "e ω⁴", "f ω⁵", "g ω⁶", "h ω⁷", "i ω⁸", "j ω⁹"),
)


class Coefficient(Item):
    """A coefficient of a polynomial with its 95 % confidence interval."""

    power: int
    unit: str
    value: float
    standard_error: float
    lo: float
    hi: float


class ForceAt(Item):
    """Force at a deformation, with intervals of the curve and of one more reading."""

    force_N: float
    lo_N: float
    hi_N: float
    reading_lo_N: float
    reading_hi_N: float


class LackOfFit(Item):
    """F test against the scatter of repeated rows, or without any the next degree."""

    against: Literal["pure error", "next degree"]
    F: float
    dof: tuple[int, int]
    p_value: float
    too_simple: bool


class Polynomial(Item):
    """A fitted polynomial; forces in N, deformations in mm, all as read.

    A number that does not exist for the data is None.

    Attributes:
        coefficients: in rising order of the powers.
        polyfit_order: all coefficients, highest power first, as polyval takes them.
        r2: about the mean force, also without intercept, so that curves compare.
        aicc: Akaike's criterion for small samples; the noise counts as a parameter.
        held_out_rows_N: root mean square error on rows left out one by one (PRESS).
        held_out_runs_N: the same with whole runs left out.
        condition_number: of the Vandermonde matrix in mm.
        covariance: of the coefficients.
    """

    model: str
    degree: int
    intercept: bool
    coefficients: tuple[Coefficient, ...]
    polyfit_order: tuple[float, ...]
    s_N: float = quantity("residual standard deviation", "N")
    dof: int
    r2: float | None
    r2_adjusted: float | None
    aicc: float | None
    aicc_over_best: float | None = None
    lack_of_fit: LackOfFit | None
    held_out_rows_N: float | None
    held_out_runs_N: float | None
    condition_number: float
    at: ForceAt | None = None
    covariance: Draws

    def force_at(self, deformation: float) -> ForceAt:
        """Return the force at a deformation as read [mm], with 95 % intervals."""
        row = columns(np.array([deformation]), self.degree, self.intercept)[0]
        force = float(row @ [one.value for one in self.coefficients])
        variance = row @ self.covariance @ row
        curve, reading = _t(self.dof) * np.sqrt([variance, variance + self.s_N**2])
        return ForceAt(
            force_N=force,
            lo_N=force - curve,
            hi_N=force + curve,
            reading_lo_N=force - reading,
            reading_hi_N=force + reading,
        )


def columns(x: np.ndarray, degree: int, intercept: bool) -> np.ndarray:
    """Return the powers of x as columns, in rising order."""
    return np.vander(x, degree + 1, increasing=True)[:, 0 if intercept else 1 :]


def fit_polynomial(
    x: np.ndarray,
    y: np.ndarray,
    degree: int,
    intercept: bool = True,
    *,
    repeats: np.ndarray | None = None,
    run: np.ndarray | None = None,
) -> Polynomial:
    """Fit a polynomial by an orthogonal factorisation of scaled columns.

    Args:
        x: deformation [mm], shape (n,).
        y: force [N], shape (n,).
        degree: highest power.
        intercept: whether the power zero is included.
        repeats: group of each row; the rows of a group are repeats of each other. By
            default those with the same x.
        run: index of the run of each row, or None.
    """
    scale = float(np.max(np.abs(x)))
    powers = np.arange(0 if intercept else 1, degree + 1)
    q, r = np.linalg.qr(columns(x / scale, degree, intercept))
    target = q.T @ y
    residual = y - q @ target
    rows, unknowns = q.shape
    squares, dof = float(residual @ residual), rows - unknowns
    root = solve_triangular(r, np.eye(unknowns)) / scale ** powers[:, None]
    values, covariance = root @ target, root @ root.T * (squares / dof)
    variation = float(np.sum((y - y.mean()) ** 2))
    left = squares / variation if variation else None
    return Polynomial(
        model=" + ".join(_TERMS[power] for power in powers),
        degree=degree,
        intercept=intercept,
        coefficients=_coefficients(powers, values, np.sqrt(np.diag(covariance)), dof),
        polyfit_order=(*values[::-1], *([] if intercept else [0.0])),
        s_N=np.sqrt(squares / dof),
        dof=dof,
        r2=None if left is None else 1.0 - left,
        r2_adjusted=None if left is None else 1.0 - left * (rows - 1) / dof,
        aicc=_aicc(rows, squares, unknowns + 1),
        lack_of_fit=_lack_of_fit(x, y, degree, intercept, squares, repeats),
        held_out_rows_N=_rows_held_out(q, residual),
        held_out_runs_N=None if run is None else _runs_held_out(q, residual, run),
        condition_number=np.linalg.cond(columns(x, degree, intercept)),
        covariance=covariance,
    )


def _t(dof: int) -> float:
    return float(stats.t.ppf(0.5 + INTERVAL / 2.0, dof))


def _coefficients(
    powers: np.ndarray, values: np.ndarray, errors: np.ndarray, dof: int
) -> tuple[Coefficient, ...]:
    return tuple(
        Coefficient(
            power=power,
            unit=("N", "N/mm", f"N/mm^{power}")[min(power, 2)],
            value=value,
            standard_error=error,
            lo=value - _t(dof) * error,
            hi=value + _t(dof) * error,
        )
        for power, value, error in zip(powers.tolist(), values, errors, strict=True)
    )


def _aicc(rows: int, squares: float, free: int) -> float | None:
    if rows - free - 1 <= 0 or squares == 0.0:
        return None
    deviance = rows * (np.log(2.0 * np.pi * squares / rows) + 1.0)
    return deviance + 2.0 * free * rows / (rows - free - 1)


def _rows_held_out(q: np.ndarray, residual: np.ndarray) -> float | None:
    left = 1.0 - np.sum(q**2, axis=1)
    if np.min(left) < _LEAST_LEFT:
        return None
    return np.sqrt(np.mean((residual / left) ** 2))


def _runs_held_out(
    q: np.ndarray, residual: np.ndarray, run: np.ndarray
) -> float | None:
    """Return the error on runs left out one by one, by Woodbury's formula.

    (I − Q_G Q_Gᵀ)⁻¹ e_G = e_G + Q_G (I − Q_Gᵀ Q_G)⁻¹ Q_Gᵀ e_G for the rows G of a run.
    """
    errors = []
    order = np.argsort(run, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(run[order])) + 1):
        part, error = q[rows], residual[rows]
        left = np.eye(q.shape[1]) - part.T @ part
        if np.linalg.eigvalsh(left)[0] < _LEAST_LEFT:
            return None
        errors.append(error + part @ np.linalg.solve(left, part.T @ error))
    return np.sqrt(np.mean(np.concatenate(errors) ** 2))


def _lack_of_fit(
    x: np.ndarray,
    y: np.ndarray,
    degree: int,
    intercept: bool,
    squares: float,
    repeats: np.ndarray | None,
) -> LackOfFit | None:
    if repeats is None:
        repeats = np.unique(x, return_inverse=True)[1]
    rows, groups, unknowns = len(y), int(repeats.max()) + 1, degree + intercept
    if groups < rows:
        means = np.bincount(repeats, y) / np.bincount(repeats)
        against, error, free = "pure error", y - means[repeats], rows - groups
    elif rows - unknowns > 1 and np.count_nonzero(np.unique(x)) > unknowns:
        scaled = x / np.max(np.abs(x))
        q = np.linalg.qr(columns(scaled, degree + 1, intercept))[0]
        against, error, free = "next degree", y - q @ (q.T @ y), rows - unknowns - 1
    else:
        return None
    extra = rows - unknowns - free
    below = float(error @ error)
    if extra < 1 or below <= 0.0:
        return None
    ratio = max(squares - below, 0.0) / extra / (below / free)
    chance = float(stats.f.sf(ratio, extra, free))
    return LackOfFit(
        against=against,
        F=ratio,
        dof=(extra, free),
        p_value=chance,
        too_simple=chance < SIGNIFICANCE,
    )
