"""Least-squares polynomials of force over deformation, compared with each other.

Intervals assume that the curve is right and that the errors of the rows are
independent, normal and of equal size: Draper and Smith, Applied Regression Analysis.
"""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field
from scipy import stats

from hdcal.data.case import Case, require_case, require_force
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings, InputError
from hdcal.report.charts.chart_spec import CYCLE, Band, Chart, Line, Mark, Panel, Points
from hdcal.report.item import INTERVAL, TAILS, Draws, Interval, Item, Words, quantity
from hdcal.report.result import Result

_TERMS = ("c", "a ω", "b ω²", "d ω³", "e ω⁴", "f ω⁵", "g ω⁶", "h ω⁷", "i ω⁸", "j ω⁹")


class Coefficient(Item):
    """A coefficient of a polynomial with its 95 % confidence interval."""

    power: int
    value: float
    standard_error: float
    lo: float
    hi: float


class Polynomial(Item):
    """A fitted polynomial; forces in N, deformations in mm, all as read.

    Attributes:
        polyfit_order: all coefficients, highest power first, as polyval takes them.
        r2: about the mean force, also without intercept; None for constant forces.
        aicc: of Hurvich and Tsai (1989); None for exact or too few rows.
    """

    model: str
    degree: int
    intercept: bool
    coefficients: tuple[Coefficient, ...]
    polyfit_order: tuple[float, ...]
    s_N: float = quantity("residual standard deviation", "N")
    dof: int
    r2: float | None
    aicc: float | None
    force_N: Interval | None = quantity("force", "N", default=None)
    reading_N: Interval | None = quantity("next reading", "N", default=None)
    covariance: Draws

    def curve(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return forces, and half widths of the curve and of one more reading [N]."""
        rows = _columns(x, self.degree, self.intercept)
        t = stats.t.ppf(TAILS[2], self.dof)
        variance = np.sum(rows @ self.covariance * rows, axis=1)
        half = t * np.sqrt(variance), t * np.sqrt(variance + self.s_N**2)
        return np.polyval(self.polyfit_order, x), *half

    def compared_at(self, deformation: float) -> "Polynomial":
        """Return the curve with its force at a deformation as read [mm]."""
        force, *half = (each[0] for each in self.curve(np.array([deformation])))
        spans = (Interval(median=force, lo=force - h, hi=force + h) for h in half)
        names = "force_N", "reading_N"
        return self.model_copy(update=dict(zip(names, spans, strict=True)))


class Fits(Result):
    """Polynomials fitted to the same data: of each degree with and without intercept.

    Forces are compared at the deformation `at_mm` as read.
    """

    template = "classical/report.md.j2"
    table = "fits"

    format: Literal["hdcal.fit/1"] = "hdcal.fit/1"
    data: dict[str, str | int]
    interval: float = INTERVAL
    interval_kind: str = "confidence interval (t), independent normal errors"
    fits: tuple[Polynomial, ...]
    at_mm: float | None
    case: InstanceOf[Case] = Field(exclude=True)

    @computed_field
    @property
    def notes(self) -> tuple[Words, ...]:
        """Remarks on the data, and what the curves do not include."""
        return self.lines("notes")

    def make_charts(self) -> Mapping[str, Chart]:
        """Return readings and curves with their confidence bands."""
        x = np.asarray(self.case.records.deformation)
        grid, marks = np.linspace(min(0.0, x.min()), max(0.0, x.max()), 200), []
        for place, curve in enumerate(self.fits):
            force, half, _ = curve.curve(grid)
            name, hue = curve.model, CYCLE[place % len(CYCLE)]
            dash = "solid" if curve.intercept else "dashed"
            low, high = force - half, force + half
            marks.append(Band(x=grid, low=low, high=high, colour=hue))
            marks.append(Line(label=name, x=grid, y=force, colour=hue, dash=dash))
        force = np.asarray(self.case.records.force)
        points: Mark = Points(label="readings", x=x, y=force)
        x_axis, y_axis = "deformation as read [mm]", "force as read [N]"
        panel = Panel(x=x_axis, y=y_axis, marks=[*marks, points])
        return {"fit": Chart(panels=[panel])}


def fit(
    case: Case, degrees: Sequence[int] = (1, 2, 3), *, at: float | None = None
) -> Fits:
    """Fit polynomials of force over deformation, with an intercept and without.

    All rows have equal weights. Temperature, direction and run are not part of the
    curve: what they change stays in the residuals.

    Args:
        case: from `read_case`.
        degrees: of the polynomials.
        at: deformation at which forces are compared [mm as read]; by default the
            nominal one of the gear file.

    Raises:
        InputError: a parameter is out of range, or the rows do not determine a curve.
    """
    require_case(case)
    require_force(case, "fit")
    at, records = case.gear.nominal_deformation if at is None else at, case.records
    with Findings() as wrong:
        wrong += implausible("degrees", list(degrees)) + implausible("at", at)
        if at is not None and abs(at) >= case.gear.reach:
            words = f"{at:g} mm is no deformation of this gear"
            wrong.append(Finding("at", words, "Give it in mm, as read"))
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    degrees = [int(degree) for degree in degrees]
    for degree in degrees:
        rank = np.linalg.matrix_rank(_columns(x / np.abs(x).max(), degree, True))
        if rank <= degree or rank == len(x):
            words = f"the deformations do not determine degree {degree}"
            remedy = "Use a lower degree, or measure at more deformations"
            raise InputError([Finding(case.name, words, remedy)])
    fits = [
        fit_polynomial(x, y, degree, intercept)
        for degree in dict.fromkeys(degrees)
        for intercept in (True, False)
    ]
    names = {"name": case.name, "gear": case.gear.name, "sha256": case.data_sha256}
    return Fits(
        data={**names, "rows": len(y)},
        fits=tuple(fits if at is None else (curve.compared_at(at) for curve in fits)),
        at_mm=at,
        case=case,
    )


def _columns(x: np.ndarray, degree: int, intercept: bool) -> np.ndarray:
    """Return the powers of x as columns, in rising order."""
    return np.vander(x, degree + 1, increasing=True)[:, 0 if intercept else 1 :]


def fit_polynomial(
    x: np.ndarray, y: np.ndarray, degree: int, intercept: bool
) -> Polynomial:
    """Fit a polynomial to forces y [N] at deformations x [mm]."""
    scale, powers = float(np.max(np.abs(x))), np.arange(not intercept, degree + 1)
    design = _columns(x / scale, degree, intercept)
    inverse = np.linalg.pinv(design)
    (rows, unknowns), residual = design.shape, y - design @ (inverse @ y)
    squares, dof = float(residual @ residual), rows - unknowns
    root = inverse / scale ** powers[:, None]
    values, covariance = root @ y, root @ root.T * (squares / dof)
    errors, variation = np.sqrt(np.diag(covariance)), float(y.var() * rows)
    columns = powers.tolist(), values, errors, stats.t.ppf(TAILS[2], dof) * errors
    return Polynomial(
        model=" + ".join(_TERMS[power] for power in powers),
        degree=degree,
        intercept=intercept,
        coefficients=tuple(
            Coefficient(power=p, value=v, standard_error=e, lo=v - half, hi=v + half)
            for p, v, e, half in zip(*columns, strict=True)
        ),
        polyfit_order=(*values[::-1], *([] if intercept else [0.0])),
        s_N=np.sqrt(squares / dof),
        dof=dof,
        r2=1.0 - squares / variation if variation else None,
        aicc=_aicc(rows, squares, unknowns + 1),
        covariance=covariance,
    )


def _aicc(rows: int, squares: float, free: int) -> float | None:
    if rows - free - 1 <= 0 or squares == 0.0:
        return None
    deviance = rows * (np.log(2.0 * np.pi * squares / rows) + 1.0)
    return deviance + 2.0 * free * rows / (rows - free - 1)
