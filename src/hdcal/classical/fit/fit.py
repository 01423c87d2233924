"""Classical least squares: polynomials of force over deformation.

What a curve-fitting tool gives, with the errors that it leaves out. Nothing here is
a posterior: intervals are confidence intervals, a statement about repeated
experiments under independent normal errors of one size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import fdtrc, stdtrit

from hdcal.data.case import Case, require_case
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings
from hdcal.report.answer import Real

LEVEL = 0.95
# A smaller chance than this says that the curve is too simple.
DOUBT = 0.05
# Beyond this condition number of the scaled columns no digit of a coefficient is left.
_WORST_CONDITION = 1e14


@dataclass(frozen=True)
class LackOfFit:
    """An F test of whether the curve is too simple.

    Attributes:
        against: `pure error` of repeated rows, or `next degree` where none repeat.
        F: ratio of the mean squares [-].
        dof: its degrees of freedom.
        p_value: chance of a ratio as large if the curve is right.
        too_simple: that chance is small.
    """

    against: Literal["pure error", "next degree"]
    F: Real
    dof: tuple[int, int]
    p_value: float
    too_simple: bool


@dataclass(frozen=True)
class PolynomialFit:
    """One least-squares polynomial; forces in N, deformation in mm, all as read.

    Attributes:
        powers: of the deformation, in rising order.
        coefficients: one for each power [N/mm^power].
        covariance: of the coefficients.
        dof: rows less coefficients.
        s: residual standard deviation [N].
        r2: share of the forces' variance about their mean that the curve explains,
            also for curves through the origin, so that all can be compared.
        r2_adjusted: the same with variances divided by their degrees of freedom.
        aicc: Akaike's criterion with the small-sample correction, smaller is better;
            the noise counts as a parameter.
        held_out: root mean square error on rows left out one at a time [N].
        held_out_runs: the same with a whole run left out at a time [N].
        condition_number: of the columns in mm, as a Vandermonde matrix has it.
        lack_of_fit: whether the curve is too simple.

    A number that does not exist for these data is None.
    """

    powers: tuple[int, ...]
    coefficients: np.ndarray
    covariance: np.ndarray
    dof: int
    s: float
    r2: float | None
    r2_adjusted: float | None
    aicc: float | None
    held_out: float | None
    held_out_runs: float | None
    condition_number: float
    lack_of_fit: LackOfFit | None

    @property
    def standard_errors(self) -> np.ndarray:
        """Standard error of each coefficient."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def confidence(self) -> np.ndarray:
        """95 % confidence interval of each coefficient, shape (2, powers)."""
        half = self._quantile * self.standard_errors
        return np.stack([self.coefficients - half, self.coefficients + half])

    @property
    def _quantile(self) -> float:
        return float(stdtrit(self.dof, 0.5 + LEVEL / 2.0))

    def at(self, deformation: float) -> dict[str, float]:
        """Return the fitted force at a deformation, with 95 % intervals [N].

        Args:
            deformation: as read [mm].

        Returns:
            `force`, the confidence interval of the curve, `lo` and `hi`, and the
            prediction interval of one more reading, `reading_lo` and `reading_hi`.
        """
        row = float(deformation) ** np.array(self.powers)
        force, variance = row @ self.coefficients, row @ self.covariance @ row
        half = self._quantile * np.sqrt(variance)
        wide = self._quantile * np.sqrt(variance + self.s**2)
        ends = {"force": force, "lo": force - half, "hi": force + half}
        ends |= {"reading_lo": force - wide, "reading_hi": force + wide}
        return {name: float(value) for name, value in ends.items()}


def fit(
    case: Case, degrees: Sequence[int] = (1, 3), *, through_origin: bool = False
) -> tuple[PolynomialFit, ...]:
    """Fit polynomials of force over deformation by least squares.

    Every row counts alike. Temperature, direction and run are not in the curve: what
    they do stays in the residuals.

    Args:
        case: from `read_case`.
        degrees: of the polynomials, each once.
        through_origin: only curves without intercept; else each degree is fitted
            with and without.

    Returns:
        For each degree the curve with intercept, then the one without.

    Raises:
        InputError: a degree is out of range, the rows are too few for it, or `case`
            is none.

    Source:
        Draper and Smith, Applied Regression Analysis; Hurvich and Tsai (1989) for
        the criterion.
    """
    require_case(case)
    first = (1,) if through_origin else (0, 1)
    wanted = [tuple(range(i, d + 1)) for d in dict.fromkeys(degrees) for i in first]
    records = case.records
    deformation, force = np.asarray(records.deformation), np.asarray(records.force)
    _check(case.name, deformation, degrees, wanted)
    run = np.asarray(records.run) if "run" in records.known else None
    repeats = same_conditions(
        deformation, np.round(records.temperature), np.asarray(records.sense)
    )
    return tuple(
        fit_powers(deformation, force, powers, repeats=repeats, run=run)
        for powers in wanted
    )


def _check(name: str, deformation, degrees, wanted) -> None:
    with Findings() as wrong:
        wrong += implausible("degrees", list(degrees))
        if not degrees:
            wrong.append(Finding("degrees", "is empty", "Write it like 1,3"))
    distinct = np.unique(deformation)
    scale = np.max(np.abs(distinct))
    with Findings() as wrong:
        for powers in wanted:
            degree = powers[-1]
            have = len(distinct) - (powers[0] == 1 and bool(np.any(distinct == 0.0)))
            if have < len(powers) or len(deformation) <= len(powers):
                words = f"{have} different deformations do not fix degree {degree}"
            elif _condition(distinct / scale, powers) > _WORST_CONDITION:
                words = f"degree {degree} leaves no digits: the deformations lie close"
            else:
                continue
            remedy = "Use a lower degree, or measure at more deformations"
            wrong.append(Finding(name, words, remedy))


def _columns(x: np.ndarray, powers: Sequence[int]) -> np.ndarray:
    return x[:, None] ** np.array(powers)


def _condition(x: np.ndarray, powers: Sequence[int]) -> float:
    return float(np.linalg.cond(_columns(x, powers)))


def same_conditions(*columns: np.ndarray) -> np.ndarray:
    """Return a number for each row; rows alike in every column share it."""
    table = np.stack(columns, axis=1)
    return np.unique(table, axis=0, return_inverse=True)[1].reshape(-1)


def fit_powers(
    x: np.ndarray,
    y: np.ndarray,
    powers: tuple[int, ...],
    *,
    repeats: np.ndarray | None = None,
    run: np.ndarray | None = None,
) -> PolynomialFit:
    """Fit y = Σ c_p x^p by least squares, through an orthogonal factorisation.

    Args:
        x: shape (n,).
        y: shape (n,).
        powers: of x, in rising order.
        repeats: group of each row; rows of one group are repeats of each other. By
            default those with the same x.
        run: index of the run of each row, or None.
    """
    scale = float(np.max(np.abs(x)))
    q, r = np.linalg.qr(_columns(x / scale, powers))
    target = q.T @ y
    residual = y - q @ target
    squares, dof = float(residual @ residual), len(y) - len(powers)
    about_mean = float(np.sum((y - y.mean()) ** 2))
    unit = scale ** -np.array(powers, dtype=float)
    root = solve_triangular(r, np.eye(len(powers))) * unit[:, None]
    varies = about_mean > 0.0
    return PolynomialFit(
        powers=powers,
        coefficients=root @ target,
        covariance=root @ root.T * (squares / dof),
        dof=dof,
        s=float(np.sqrt(squares / dof)),
        r2=1.0 - squares / about_mean if varies else None,
        r2_adjusted=(
            1.0 - squares / dof / (about_mean / (len(y) - 1)) if varies else None
        ),
        aicc=_aicc(len(y), squares, len(powers) + 1),
        held_out=_left_out(q, residual, np.arange(len(y))),
        held_out_runs=None if run is None else _left_out(q, residual, run),
        condition_number=_condition(x, powers),
        lack_of_fit=_lack_of_fit(x, y, powers, squares, repeats),
    )


def _aicc(rows: int, squares: float, free: int) -> float | None:
    if rows - free - 1 <= 0 or squares == 0.0:
        return None
    deviance = rows * (np.log(2.0 * np.pi * squares / rows) + 1.0)
    return float(deviance + 2.0 * free + 2.0 * free * (free + 1) / (rows - free - 1))


def _left_out(q: np.ndarray, residual: np.ndarray, group: np.ndarray) -> float | None:
    """Return the root mean square error on rows left out group by group.

    Exact without refitting: the error of the rows G is (I − Q_G Q_Gᵀ)⁻¹ e_G, by
    Woodbury e_G + Q_G (I − Q_Gᵀ Q_G)⁻¹ Q_Gᵀ e_G (Allen's PRESS for single rows).
    """
    if len(q) == len(np.unique(group)):
        kept = 1.0 - np.sum(q**2, axis=1)
        if np.min(kept) < 1e-12:
            return None
        return float(np.sqrt(np.mean((residual / kept) ** 2)))
    total, one = 0.0, np.eye(q.shape[1])
    order = np.argsort(group, kind="stable")
    cuts = np.flatnonzero(np.diff(group[order])) + 1
    for rows in np.split(order, cuts):
        part, left = q[rows], one - q[rows].T @ q[rows]
        # Without these rows the others do not fix the curve.
        if np.linalg.eigvalsh(left)[0] < 1e-12:
            return None
        error = residual[rows]
        error = error + part @ np.linalg.solve(left, part.T @ error)
        total += float(error @ error)
    return float(np.sqrt(total / len(q)))


def _lack_of_fit(x, y, powers, squares: float, repeats) -> LackOfFit | None:
    group = same_conditions(x) if repeats is None else repeats
    distinct = int(group.max()) + 1
    if distinct < len(y):
        mean = np.bincount(group, y) / np.bincount(group)
        pure, free = float(np.sum((y - mean[group]) ** 2)), len(y) - distinct
        return _ratio("pure error", squares, pure, distinct - len(powers), free)
    larger = (*powers, powers[-1] + 1)
    free = len(y) - len(larger)
    if free < 1 or len(np.unique(x[x != 0.0])) < len(larger):
        return None
    q = np.linalg.qr(_columns(x / np.max(np.abs(x)), larger))[0]
    left = y - q @ (q.T @ y)
    return _ratio("next degree", squares, float(left @ left), 1, free)


def _ratio(against, squares, below, extra: int, free: int) -> LackOfFit | None:
    if extra < 1 or below <= 0.0:
        return None
    ratio = max(squares - below, 0.0) / extra / (below / free)
    chance = float(fdtrc(extra, free, ratio))
    return LackOfFit(against, float(ratio), (extra, free), chance, chance < DOUBT)
