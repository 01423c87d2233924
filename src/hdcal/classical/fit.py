"""Least-squares polynomials of force over deformation, compared with each other."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.classical.charts import fit_chart
from hdcal.classical.polynomial import (
    SIGNIFICANCE,
    ForceAt,
    Polynomial,
    columns,
    fit_polynomial,
)
from hdcal.data.case import Case, require_case, require_force
from hdcal.data.plausible import implausible
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, Findings
from hdcal.prediction.bands.bands import predict
from hdcal.prediction.engine.causes import averaging_words
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import Pooled, pool
from hdcal.report.chart_spec import Chart
from hdcal.report.item import INTERVAL, Interval, Item, Words
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.result import Result

# Beyond this condition number of the scaled columns no digit of a coefficient is left.
_WORST_CONDITION = 1e14


class FittedData(Item):
    """The fitted data."""

    name: str
    gear: str
    rows: int
    sha256: str


class PredictedForceAt(ForceAt):
    """Force at a deformation, predicted by a calibration."""

    temperature_C: float
    tested: bool


class Calibrated(Item):
    """A calibration of the same data."""

    interval_kind: str = "equal-tailed credible interval"
    theory: str
    effects: tuple[str, ...]
    with_gap: bool
    stiffness_N_per_mm: Interval
    sigma_N: Interval
    at: PredictedForceAt | None


class Fits(Result):
    """Polynomials fitted to the same data; a sequence of them.

    Attributes:
        fits: for each degree the curve with intercept, then the one without.
        at_mm: deformation at which forces are compared, as read.
        bayesian: a calibration of the same data, to compare with.
        case: the data.
        averaging: over which models the calibration averages, in sentences.
    """

    template = "classical/report.md.j2"
    table = "fits"
    significance: ClassVar = SIGNIFICANCE

    format: Literal["hdcal.fit/1"] = "hdcal.fit/1"
    data: FittedData
    interval: float = INTERVAL
    interval_kind: str = (
        "confidence interval (t), independent normal errors of one size"
    )
    fits: tuple[Polynomial, ...]
    at_mm: float | None
    bayesian: Calibrated | None
    case: Annotated[InstanceOf[Case], Field(exclude=True)]
    averaging: tuple[str, ...] = Field(default=(), exclude=True)

    def __iter__(self) -> Iterator[Polynomial]:  # type: ignore[override]
        """Iterate over the curves."""
        return iter(self.fits)

    def __len__(self) -> int:
        """Return the number of curves."""
        return len(self.fits)

    def __getitem__(self, place: int) -> Polynomial:
        """Return a curve by its place."""
        return self.fits[place]

    @computed_field
    @property
    def notes(self) -> tuple[Words, ...]:
        """Remarks on the data, and what the curves do not include."""
        return self.lines("notes")

    @property
    def loop_N(self) -> float | None:
        """Mean distance of loading from unloading; None without both."""
        records = self.case.records
        x, y, sense = map(
            np.asarray, (records.deformation, records.force, records.sense)
        )
        up, down = sense > 0.0, sense < 0.0
        if not (up.any() and down.any()):
            return None
        # A cubic takes out what depends on the deformation alone.
        error = y - np.polyval(np.polyfit(x, y, 3), x)
        return abs(float(error[up].mean() - error[down].mean()))

    @property
    def provenance(self) -> list[tuple[str, str]]:
        """What was measured, as pairs of name and words."""
        return [*gear_rows(self.case, self.case.gear.theory), *data_rows(self.case)]

    def make_charts(self) -> Mapping[str, Chart]:
        """Return readings, curves and residuals."""
        return {"fit": fit_chart(self.case.records, self.fits)}


def fit(
    case: Case,
    degrees: Sequence[int] = (1, 3),
    *,
    through_origin: bool = False,
    at: float | None = None,
    posterior: Models | None = None,
) -> Fits:
    """Fit polynomials of force over deformation by least squares.

    All rows have equal weights. Temperature, direction and run are not part of the
    curve: what they change stays in the residuals.

    Args:
        case: from `read_case`.
        degrees: of the polynomials.
        through_origin: only curves without intercept; else each degree is fitted
            with and without.
        at: deformation at which forces are compared [mm as read]; by default the
            nominal one of the gear file.
        posterior: a calibration of the same data, to compare with.

    Raises:
        InputError: a parameter is out of range, the rows do not determine a curve, or
            the calibration is of other data.
        NotUsable: the calibration failed its checks.
    """
    require_case(case)
    require_force(case, "fit")
    at = case.gear.nominal_deformation if at is None else at
    models = None if posterior is None else pool(posterior)
    _check_request(case, degrees, at, models)
    records = case.records
    x, y = np.asarray(records.deformation), np.asarray(records.force)
    intercepts = (False,) if through_origin else (True, False)
    curves = [(d, i) for d in dict.fromkeys(degrees) for i in intercepts]
    with Findings() as wrong:
        for curve in curves:
            wrong += _undetermined(case.name, x, *curve)
    alike = np.column_stack([x, np.round(records.temperature), records.sense])
    repeats = np.unique(alike, axis=0, return_inverse=True)[1].ravel()
    run = np.asarray(records.run) if "run" in records.known else None
    fits = [fit_polynomial(x, y, *each, repeats=repeats, run=run) for each in curves]
    best = min((one.aicc for one in fits if one.aicc is not None), default=0.0)
    return Fits(
        data=FittedData(
            name=case.name, gear=case.gear.name, rows=len(y), sha256=case.data_sha256
        ),
        fits=tuple(_compared(one, best, at) for one in fits),
        at_mm=at,
        bayesian=None if models is None else _calibrated(models, at),
        case=case,
        averaging=() if models is None else tuple(averaging_words(models.causes)),
        part="part" if case.gear.theory == SPRING else "gear",
    )


def _check_request(
    case: Case, degrees: Sequence[int], at: float | None, models: Pooled | None
) -> None:
    with Findings() as wrong:
        wrong += implausible("degrees", list(degrees))
        if not degrees:
            wrong.append(Finding("degrees", "is empty", "Write it like 1,3"))
        wrong += (outside := implausible("at", at))
        if at is not None and not outside and not abs(at) < case.gear.reach:
            words = f"{at:g} mm is no deformation of this gear"
            wrong.append(Finding("at", words, "Give it in mm, as read"))
        if models is not None and models.case.data_sha256 != case.data_sha256:
            words = f"is a calibration of other data ({models.case.name})"
            remedy = "Name the result folder that was made from these data"
            wrong.append(Finding("posterior", words, remedy))


def _undetermined(
    name: str, x: np.ndarray, degree: int, intercept: bool
) -> list[Finding]:
    """Return a finding where the rows do not determine a polynomial."""
    distinct, unknowns = np.unique(x if intercept else x[x != 0.0]), degree + intercept
    if len(distinct) < unknowns or len(x) <= unknowns:
        words = f"{len(distinct)} different deformations do not fix degree {degree}"
    else:
        scaled = columns(distinct / np.max(np.abs(x)), degree, intercept)
        if np.linalg.cond(scaled) <= _WORST_CONDITION:
            return []
        words = f"degree {degree} leaves no digits: the deformations lie close"
    remedy = "Use a lower degree, or measure at more deformations"
    return [Finding(name, words, remedy)]


def _compared(curve: Polynomial, best: float, at: float | None) -> Polynomial:
    over = None if curve.aicc is None else curve.aicc - best
    force = None if at is None else curve.force_at(at)
    return curve.model_copy(update={"aicc_over_best": over, "at": force})


def _calibrated(models: Pooled, at: float | None) -> Calibrated:
    return Calibrated(
        theory=models.theory,
        effects=tuple(effect.name for effect in models.effects),
        with_gap=models.with_gap,
        stiffness_N_per_mm=Interval.of(models.values["stiffness"]),
        sigma_N=Interval.of(models.values["sigma"]),
        at=None if at is None else _predicted(models, at),
    )


def _predicted(models: Pooled, at: float) -> PredictedForceAt:
    weighed = [(one.probability, one.posterior) for one in models.causes]
    bands = predict(weighed, [at]).to_frame().iloc[0]
    return PredictedForceAt(
        force_N=bands["physics_median_N"],
        lo_N=bands["physics_lo_N"],
        hi_N=bands["physics_hi_N"],
        reading_lo_N=bands["new_measurement_lo_N"],
        reading_hi_N=bands["new_measurement_hi_N"],
        temperature_C=bands["temperature_C"],
        tested=bands["tested"],
    )
