"""The JSON answer of classical fits: what each number in it is."""

from dataclasses import dataclass
from typing import Literal

from hdcal.classical.fit.fit import LackOfFit
from hdcal.report.answer import Answer, Real
from hdcal.report.parameters import Interval


@dataclass(frozen=True)
class Coefficient:
    """One coefficient of a polynomial, with standard error and 95 % interval."""

    power: int
    unit: str
    value: float
    standard_error: Real
    lo: Real
    hi: Real


@dataclass(frozen=True, kw_only=True)
class ForceAt:
    """Force of a curve or model at one deformation, with both of its intervals."""

    force_N: float
    lo_N: Real
    hi_N: Real
    reading_lo_N: Real
    reading_hi_N: Real


@dataclass(frozen=True, kw_only=True)
class BayesianForceAt(ForceAt):
    """The same of a calibration."""

    temperature_C: float
    tested: bool


@dataclass(frozen=True)
class FittedCurve:
    """One polynomial with everything that a curve-fitting tool gives."""

    model: str
    degree: int
    intercept: bool
    coefficients: tuple[Coefficient, ...]
    polyfit_order: tuple[float, ...]
    s_N: Real
    dof: int
    r2: float | None
    r2_adjusted: float | None
    aicc: float | None
    aicc_over_best: float | None
    lack_of_fit: LackOfFit | None
    held_out_rows_N: float | None
    held_out_runs_N: float | None
    condition_number: Real
    at: ForceAt | None


@dataclass(frozen=True)
class BayesianAnswer:
    """A calibration of the same data."""

    interval_kind: str
    theory: str
    effects: tuple[str, ...]
    with_gap: bool
    stiffness_N_per_mm: Interval
    sigma_N: Interval
    at: BayesianForceAt | None


@dataclass(frozen=True)
class FittedData:
    """Which data were fitted."""

    name: str
    gear: str
    rows: int
    sha256: str


@dataclass(frozen=True, kw_only=True)
class FitAnswer(Answer):
    """What `hdcal fit` answers; fit.json."""

    schema: Literal["hdcal.fit/1"] = "hdcal.fit/1"
    data: FittedData
    interval: float
    interval_kind: str
    fits: tuple[FittedCurve, ...]
    at_mm: float | None
    bayesian: BayesianAnswer | None
    notes: tuple[str, ...]
