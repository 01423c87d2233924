"""Classical fits as plain data, with the Bayesian answer beside them."""

from collections.abc import Sequence

import numpy as np

from hdcal.classical.fit.fit import LEVEL, PolynomialFit
from hdcal.data.case import Case
from hdcal.errors import Finding, InputError
from hdcal.inference.posterior import Posterior
from hdcal.prediction.bands.bands import predict
from hdcal.report.parameters import interval

SCHEMA = "hdcal.fit/1"
# A smaller chance than this says that the curve is too simple.
DOUBT = 0.05
KIND = "confidence interval (t), independent normal errors of one size"


def summarise_fits(
    case: Case,
    fits: Sequence[PolynomialFit],
    *,
    at: float | None = None,
    posterior: Posterior | None = None,
) -> dict:
    """Return classical fits as plain data, ready for JSON.

    Args:
        case: that was fitted.
        fits: from `fit`.
        at: a deformation at which all answers are compared [mm as read]; by default
            the gear's nominal one, if the gear file names one.
        posterior: a calibration of the same data.

    Raises:
        InputError: the calibration is of other data, or `at` is not a deformation.
        NotUsable: the calibration failed its checks.
    """
    at = case.gear.nominal_deformation if at is None else at
    _check(case, at, posterior)
    known = [f.aicc for f in fits if f.aicc is not None]
    return {
        "schema": SCHEMA,
        "status": "ok",
        "data": {
            "name": case.name,
            "gear": case.gear.name,
            "rows": len(case.records.force),
            "sha256": case.data_sha256,
        },
        "interval": LEVEL,
        "interval_kind": KIND,
        "fits": [_entry(one, at, min(known, default=None)) for one in fits],
        "at_mm": at,
        "bayesian": None if posterior is None else _beside(posterior, at),
        "notes": list(case.notes) + _notes(case),
    }


def _check(case: Case, at: float | None, posterior: Posterior | None) -> None:
    findings = []
    reach = case.gear.geometry.radius * (2 if case.gear.reading == "diametral" else 1)
    if at is not None and not abs(at) < reach:
        words = f"{at:g} mm is no deformation of this gear"
        findings.append(Finding("--at", words, "Give it in mm, as read"))
    if posterior is not None and posterior.case.data_sha256 != case.data_sha256:
        words = f"is a calibration of other data ({posterior.case.name})"
        remedy = "Name the result folder that was made from these data"
        findings.append(Finding("--run", words, remedy))
    if findings:
        raise InputError(findings)


def model_name(powers: Sequence[int]) -> str:
    """Return a polynomial as it is written: c + a ω + b ω² + d ω³ …."""
    terms = ["c", "a ω", *(f"{'bdefghij'[p - 2]} {omega(p)}" for p in range(2, 10))]
    return " + ".join(terms[power] for power in powers)


def omega(power: int) -> str:
    """Return a power of the deformation as it is written: ω²."""
    return "ω" if power == 1 else f"ω{'⁰¹²³⁴⁵⁶⁷⁸⁹'[power]}"


def _entry(one: PolynomialFit, at: float | None, best: float | None) -> dict:
    lack, errors, ends = one.lack_of_fit, one.standard_errors, one.confidence
    return {
        "model": model_name(one.powers),
        "degree": one.powers[-1],
        "intercept": one.powers[0] == 0,
        "coefficients": [
            {
                "power": power,
                "unit": "N" if power == 0 else f"N/mm^{power}".removesuffix("^1"),
                "value": float(one.coefficients[i]),
                "standard_error": float(errors[i]),
                "lo": float(ends[0, i]),
                "hi": float(ends[1, i]),
            }
            for i, power in enumerate(one.powers)
        ],
        "polyfit_order": _highest_first(one),
        "s_N": one.s,
        "dof": one.dof,
        "r2": one.r2,
        "r2_adjusted": one.r2_adjusted,
        "aicc": one.aicc,
        "aicc_over_best": None if one.aicc is None or best is None else one.aicc - best,
        "lack_of_fit": None
        if lack is None
        else {
            "against": lack.against,
            "F": lack.F,
            "dof": list(lack.dof),
            "p_value": lack.p_value,
            "too_simple": lack.p_value < DOUBT,
        },
        "held_out_rows_N": one.held_out,
        "held_out_runs_N": one.held_out_runs,
        "condition_number": one.condition_number,
        "at": None if at is None else {f"{k}_N": v for k, v in one.at(at).items()},
    }


def _highest_first(one: PolynomialFit) -> list[float]:
    """Return the coefficients as polyfit and polyval order them, highest first."""
    full = np.zeros(one.powers[-1] + 1)
    full[list(one.powers)] = one.coefficients
    return full[::-1].tolist()


def _beside(posterior: Posterior, at: float | None) -> dict:
    posterior.require_usable()
    found = {
        "interval_kind": "equal-tailed credible interval",
        "theory": posterior.theory,
        "effects": [effect.name for effect in posterior.effects],
        "with_gap": bool(posterior.settings["with_gap"]),
        "stiffness_N_per_mm": interval(posterior.draws["stiffness"]),
        "sigma_N": interval(posterior.draws["sigma"]),
        "at": None,
    }
    if at is not None:
        bands = {n: v[0] for n, v in predict(posterior, [at]).columns().items()}
        found["at"] = {
            "force_N": float(bands["physics_median_N"]),
            "lo_N": float(bands["physics_lo_N"]),
            "hi_N": float(bands["physics_hi_N"]),
            "reading_lo_N": float(bands["new_measurement_lo_N"]),
            "reading_hi_N": float(bands["new_measurement_hi_N"]),
            "temperature_C": float(bands["temperature_C"]),
            "tested": bool(bands["tested"]),
        }
    return found


def _notes(case: Case) -> list[str]:
    """Say what the curves leave out of account."""
    records, notes = case.records, []
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    if warm - cold > 1.0:
        notes.append(
            f"the temperature went from {cold:g} to {warm:g} °C: no curve here knows it"
        )
    if len(np.unique(records.sense)) > 1:
        notes.append("loading and unloading are fitted as one curve")
    for kind, labels in (("run", case.run_labels), ("gear", case.specimen_labels)):
        if len(labels) > 1:
            notes.append(
                f"{len(labels)} {kind}s are fitted as one: errors within a {kind} are "
                "then not independent, and intervals are too narrow"
            )
    if np.any(records.force_sd):
        notes.append("the stated errors of the rows (force_sd) are not used as weights")
    return notes
