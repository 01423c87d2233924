"""Calibration of mass, damping and stiffness from the record of a gear in motion."""

import time
from collections.abc import Mapping
from functools import partial
from typing import Any, Literal

import jax
import numpy as np
import pandas as pd
from pydantic import Field, computed_field
from scipy.special import chdtrc

from hdcal.data.case import Case, Theory, require_case, require_force
from hdcal.errors import Finding, Findings
from hdcal.inference.checks import Check
from hdcal.inference.force_model.assembly import (
    MOST_LOG_LIKELIHOODS,
    assemble,
    run_settings,
)
from hdcal.inference.sample import Draws, Progress, check_settings, sample
from hdcal.motion.charts import motion_chart
from hdcal.motion.dynamic_problem import (
    SITES,
    DynamicPosterior,
    DynamicProblem,
    build_dynamic,
    dynamic_site_priors,
    motion_rows,
    pointwise,
    predict_motion,
)
from hdcal.motion.mode_search import highest_peak
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.charts.draws_charts import prior_chart
from hdcal.report.item import TAILS, Interval, Words, quantity
from hdcal.report.posterior_result import (
    PARAMETER_NAMES,
    ParameterEstimate,
    PosteriorResult,
    posterior_fields,
)

FEWEST_ROWS = 20
_WHITE, _RATE = "residuals are noise", "rows resolve the vibration"
# Residuals with a smaller p value over so many lags are not white noise.
_LEAST_P, _LAGS = 1e-3, 20
_LEAST_PER_PERIOD = 6.0
# Derived quantities whose chains must have mixed.
_DERIVED = ("stiffness", "damping", "natural_frequency")
_REQUIRED = {"required": ["K", "E0", *SITES], "propertyNames": {**PARAMETER_NAMES}}
# Draws of the bands; of long records fewer, to bound the numbers in memory.
_DRAWS, _FEWEST, _MOST_NUMBERS = 1000, 100, 50_000_000
# Rows whose quantiles are computed together.
_ROWS = 10_000


def calibrate_dynamic(
    case: Case,
    *,
    theory: Theory | None = None,
    chains: int = 4,
    warmup: int = 1000,
    draws: int = 1000,
    seed: int = 0,
    progress: Progress | None = None,
) -> DynamicPosterior:
    """Calibrate m ÿ + c ẏ + k y = F(t) against a time series.

    The force is exact and linear between the rows; the deformation is read with an
    offset and white noise; k follows the temperature. The case holds one run, with
    time; settings are those of `calibrate`. The posterior may have failed its checks,
    see `Posterior.usable`.

    Raises:
        InputError: the record does not suit the model.
    """
    require_case(case)
    require_force(case, "calibrate with --dynamic")
    check_settings(chains, warmup, draws, seed)
    _check_record(case)
    began, theory = time.perf_counter(), theory or case.gear.theory
    priors = dynamic_site_priors(case, theory)
    problem = build_dynamic(case, priors, theory)
    mode, rival = highest_peak(problem)
    size = {"chains": chains, "warmup": warmup, "draws": draws}
    sampled = sample(problem, mode, seed, progress=progress, **size)
    specifics = _specifics(problem, sampled, rival)
    parts = assemble(case, priors, problem, sampled, seed=seed, **specifics)
    settings = {"seed": seed, **size, "with_gap": False, **run_settings(sampled, began)}
    return DynamicPosterior(case, theory, (), priors, *parts, settings)


def _check_record(case: Case) -> None:
    """Refuse records that are not the time series of one moving gear."""
    records, rows = case.records, len(case.records.force)
    late = np.flatnonzero(np.diff(records.time) <= 0.0)
    with Findings() as wrong:

        def find(problem: str, remedy: str) -> None:
            wrong.append(Finding(case.name, problem, remedy))

        if "time" not in records.known:
            find("no column contains the time", "Add a column such as time_s")
        elif len(case.run_labels) > 1 or len(case.specimen_labels) > 1:
            find("contains several runs or gears", "Calibrate one run of one gear")
        elif late.size:
            words = f"reading {late[0] + 2} is not later than the previous one"
            find(words, "State the time of each reading")
        if rows < FEWEST_ROWS:
            words = f"contains {rows} rows of readings"
            find(words, f"At least {FEWEST_ROWS} are needed")
        if np.any(records.force_sd > 0.0):
            remedy = "The force is assumed to be exact: leave force_sd out"
            find("states an sd of the force", remedy)


def _specifics(problem: DynamicProblem, sampled: Draws, rival: Check) -> dict[str, Any]:
    """Return what the dynamic model adds to what every calibration has."""
    place = np.unravel_index(np.argmax(sampled.statistics["lp"]), sampled.shape)
    best = {name: values[place] for name, values in sampled.values.items()}
    free = [name for name, prior in problem.priors.items() if prior.family != "fixed"]
    free = {name: best[name] for name in free if name != "deformation_sigma"}
    slopes, sd = _slopes(problem, best, free), best["deformation_sigma"]
    by_row = {}
    if np.prod(sampled.shape) * problem.count <= MOST_LOG_LIKELIHOODS:
        rows = np.asarray(_pointwise(problem, sampled.values))
        by_row["deformation"] = rows[..., : problem.count]
    return dict(
        log_likelihood=by_row,
        sensitivities={
            n: np.asarray(s)[: problem.count] / sd for n, s in slopes.items()
        },
        mixed={n: d for n in _DERIVED if np.ptp(d := sampled.values[n]) > 0.0},
        checks=[rival, whiteness_check(problem, best), _rate_check(problem, best)],
        observed=("force", "deformation"),
    )


@jax.jit
def _slopes(problem: DynamicProblem, values, free):
    return jax.jacfwd(lambda moved: predict_motion(problem, {**values, **moved}))(free)


@jax.jit
def _pointwise(problem: DynamicProblem, values):
    # Draws of a chain one after the other: all at once fill the memory.
    return jax.vmap(partial(jax.lax.map, partial(pointwise, problem)))(values)


def whiteness_check(problem: DynamicProblem, values) -> Check:
    """Warn where residuals are correlated, by the test of Ljung and Box."""
    read = np.asarray(problem.deformation)[: problem.count]
    left = read - motion_rows(problem, values)
    left, rows = left - left.mean(), len(left)
    lags = np.arange(1, min(_LAGS, rows // 4) + 1)
    power = max(float(left @ left), np.finfo(float).tiny)
    share = np.array([left[lag:] @ left[:-lag] for lag in lags]) / power
    p = chdtrc(len(lags), rows * (rows + 2) * np.sum(share**2 / (rows - lags)))
    if p >= _LEAST_P:
        return Check(_WHITE, "passed", f"no correlation over rows (p = {p:.2g})")
    words = f"residuals are correlated from row to row (p = {p:.1g}): the model is "
    words += "incomplete, and the intervals are too narrow"
    return Check(_WHITE, "warning", words)


def _rate_check(problem: DynamicProblem, values) -> Check:
    """Check that the force may be taken as linear between the rows."""
    steps = np.diff(problem.time[: problem.count]) * float(values["natural_frequency"])
    words = f"{1.0 / np.median(steps):.1f} rows per period"
    if np.median(steps) * _LEAST_PER_PERIOD <= 1.0:
        return Check(_RATE, "passed", words)
    remedy = "too few, as the force is interpolated linearly; sample faster"
    return Check(_RATE, "warning", f"{words}: {remedy}")


class DynamicCalibration(PosteriorResult):
    """A dynamic calibration, at the mean temperature of the test, and its bands."""

    template = "motion/dynamic.md.j2"

    format: Literal["hdcal.dynamic-calibration/3"] = "hdcal.dynamic-calibration/3"
    parameters: dict[str, ParameterEstimate] = Field(json_schema_extra={**_REQUIRED})
    natural_frequency_Hz: Interval = quantity("natural frequency", "Hz")
    damped_frequency_Hz: Interval = quantity("damped natural frequency", "Hz")
    damping_ratio: Interval = quantity("damping ratio ζ")
    damping_N_s_per_mm: Interval = quantity("damping c", "N·s/mm")
    bands: pd.DataFrame = Field(exclude=True)

    @computed_field
    @property
    def assumptions(self) -> tuple[Words, ...]:
        """Assumptions of the model, in sentences."""
        return self.lines("assumptions")

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the record with bands, and priors."""
        priors = prior_chart(self.posterior)
        return {"motion": motion_chart(self.bands), "priors": priors}


def dynamic_calibration_of(posterior: DynamicPosterior) -> DynamicCalibration:
    """Return a dynamic calibration as a result."""
    draws = posterior.draws
    ratio, frequency = draws["damping_ratio"], draws["natural_frequency"]
    damped = frequency * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
    return DynamicCalibration(
        **posterior_fields(posterior),
        natural_frequency_Hz=Interval.of(frequency),
        damped_frequency_Hz=Interval.of(damped),
        damping_ratio=Interval.of(ratio),
        damping_N_s_per_mm=Interval.of(draws["damping"]),
        bands=motion_bands(posterior),
    )


def motion_bands(posterior: DynamicPosterior, seed: int = 0) -> pd.DataFrame:
    """Return the record with equal-tailed 95 % bands, a row per reading."""
    problem, draws = posterior.moving, posterior.draws
    count = int(np.clip(_MOST_NUMBERS // problem.count, _FEWEST, _DRAWS))
    rows = np.linspace(0, len(draws["mass"]) - 1, count).astype(int)
    values = {name: each[rows] for name, each in draws.items()}
    real = slice(problem.count)
    mean = np.asarray(_each_motion(problem, values))[:, real]
    # The same quantile of the noise in all rows of a draw keeps the band smooth.
    noise = np.random.default_rng(seed).normal(0.0, values["deformation_sigma"])
    parts = np.array_split(mean, -(-mean.shape[1] // _ROWS), axis=1)
    quantiles = [
        [np.quantile(draws, TAILS, axis=0) for draws in (part, part + noise[:, None])]
        for part in parts
    ]
    (low, middle, high), (new_low, _, new_high) = np.concatenate(quantiles, axis=2)
    return pd.DataFrame(
        {
            "time_s": problem.time[real],
            "force_N": problem.force[real],
            "deformation_mm": problem.deformation[real],
            "mean_lo_mm": low,
            "mean_median_mm": middle,
            "mean_hi_mm": high,
            "new_measurement_lo_mm": new_low,
            "new_measurement_hi_mm": new_high,
            "usable": posterior.usable,
        }
    )


@jax.jit
def _each_motion(problem: DynamicProblem, values):
    return jax.lax.map(lambda value: predict_motion(problem, value), values)
