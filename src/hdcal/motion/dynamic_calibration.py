"""Calibration of mass, damping and stiffness from the record of a gear in motion."""

import time
from functools import partial
from typing import Any

import jax
import numpy as np
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
from hdcal.motion.dynamic_problem import (
    DynamicPosterior,
    DynamicProblem,
    build_dynamic,
    dynamic_site_priors,
    motion_rows,
    pointwise,
    predict_motion,
)
from hdcal.motion.mode_search import highest_peak

FEWEST_ROWS = 20
_WHITE, _RATE = "residuals are noise", "rows resolve the vibration"
# Residuals with a smaller p value over so many lags are not white noise.
_LEAST_P, _LAGS = 1e-3, 20
_LEAST_PER_PERIOD = 6.0
# Derived quantities whose chains must have mixed.
_DERIVED = ("stiffness", "damping", "natural_frequency")


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
    offset and white noise; k follows the temperature.

    Args:
        case: from `read_case`; one run, with time.
        theory: overrides the gear's theory.
        chains: independent chains, two or more.
        warmup: iterations of adaptation per chain.
        draws: draws kept per chain.
        seed: of `jax.random.key`; the same seed gives the same draws.
        progress: called with (iterations done, iterations in all).

    Returns:
        The posterior; it may have failed its checks, see `Posterior.usable`.

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
            find("no column holds the time", "A moving gear needs one, such as time_s")
        elif len(case.run_labels) > 1 or len(case.specimen_labels) > 1:
            find("holds several runs or gears", "Calibrate one run of one gear")
        elif late.size:
            words = f"reading {late[0] + 2} is not later than the one before"
            find(words, "Give each reading its time")
        if rows < FEWEST_ROWS:
            find(f"holds {rows} rows of readings", f"At least {FEWEST_ROWS} are needed")
        if np.any(records.force_sd > 0.0):
            remedy = "The force is taken as exact: leave it out"
            find("gives an sd of the force", remedy)


def _specifics(problem: DynamicProblem, sampled: Draws, rival: Check) -> dict[str, Any]:
    """Return what the dynamic model adds to what every calibration has."""
    place = np.unravel_index(np.argmax(sampled.statistics["lp"]), sampled.shape)
    best = {name: values[place] for name, values in sampled.values.items()}
    free = [name for name, prior in problem.priors.items() if prior.family != "fixed"]
    free = {name: best[name] for name in free if name != "deformation_sigma"}
    slopes, sd = _slopes(problem, best, free), best["deformation_sigma"]
    by_row = {}
    if np.prod(sampled.shape) * problem.count <= MOST_LOG_LIKELIHOODS:
        each = np.asarray(_pointwise(problem, sampled.values))
        by_row["deformation"] = each[..., : problem.count]
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
    words = f"residuals are correlated from row to row (p = {p:.1g}): the model does "
    return Check(_WHITE, "warning", words + "not hold, the intervals are too narrow")


def _rate_check(problem: DynamicProblem, values) -> Check:
    """Check that the force may be taken as linear between the rows."""
    steps = np.diff(problem.time[: problem.count]) * float(values["natural_frequency"])
    words = f"{1.0 / np.median(steps):.1f} rows per period"
    if np.median(steps) * _LEAST_PER_PERIOD <= 1.0:
        return Check(_RATE, "passed", words)
    remedy = "the force between rows is taken as straight; sample faster"
    return Check(_RATE, "warning", f"{words}: {remedy}")
