"""Classical fits as an answer, with the Bayesian answer beside them."""

from collections.abc import Sequence

import numpy as np

from hdcal.classical.fit.answer import (
    BayesianAnswer,
    BayesianForceAt,
    Coefficient,
    FitAnswer,
    FittedCurve,
    FittedData,
    ForceAt,
)
from hdcal.classical.fit.document import fit_document, headline, notes
from hdcal.classical.fit.fit import LEVEL, PolynomialFit
from hdcal.classical.fit.notation import model_name
from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.errors import Finding, Findings
from hdcal.prediction.bands.bands import predict
from hdcal.prediction.engine.causes import averaging_words
from hdcal.prediction.engine.models import Models
from hdcal.prediction.engine.pooled import Pooled, pool
from hdcal.report.parameters import credible_interval
from hdcal.report.write import Report

KIND = "confidence interval (t), independent normal errors of one size"


def fit_answer(
    case: Case,
    fits: Sequence[PolynomialFit],
    *,
    at: float | None = None,
    posterior: Models | None = None,
) -> FitAnswer:
    """Return classical fits as an answer, ready for JSON.

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
    models = None if posterior is None else pool(posterior)
    _check(case, at, models)
    known = [f.aicc for f in fits if f.aicc is not None]
    curves = tuple(_curve(one, at, min(known, default=None)) for one in fits)
    rows = len(case.records.force)
    return FitAnswer(
        status="ok",
        reasons=(),
        headline=headline(curves),
        next_step=None,
        data=FittedData(case.name, case.gear.name, rows, case.data_sha256),
        interval=LEVEL,
        interval_kind=KIND,
        fits=curves,
        at_mm=at,
        bayesian=None if models is None else _beside(models, at),
        notes=(*case.notes, *notes(case), *_averaging(models)),
    )


def fit_report(
    case: Case,
    fits: Sequence[PolynomialFit],
    command: str = "",
    *,
    at: float | None = None,
    posterior: Models | None = None,
) -> Report[FitAnswer]:
    """Return all that `hdcal fit` leaves behind.

    Args and errors are those of `fit_answer`; `command` says how it was made.
    """

    def figures():
        from hdcal.classical.fit.figure import fit_figure

        return {"fit": fit_figure(case, fits)}

    def charts():
        from hdcal.classical.fit.chart import fit_charts

        return {"fit": fit_charts(case, fits)}

    found = fit_answer(case, fits, at=at, posterior=posterior)
    document = fit_document(case, found, command)
    return Report(document, found, "fit.json", figures, charts=charts)


def _check(case: Case, at: float | None, models: Pooled | None) -> None:
    with Findings() as wrong:
        wrong += (outside := implausible("at", at))
        if at is not None and not outside and not abs(at) < case.gear.reach:
            words = f"{at:g} mm is no deformation of this gear"
            wrong.append(Finding("at", words, "Give it in mm, as read"))
        if models is not None and models.case.data_sha256 != case.data_sha256:
            words = f"is a calibration of other data ({models.case.name})"
            remedy = "Name the result folder that was made from these data"
            wrong.append(Finding("run", words, remedy))


def _curve(one: PolynomialFit, at: float | None, best: float | None) -> FittedCurve:
    errors, ends = one.standard_errors, one.confidence
    return FittedCurve(
        model=model_name(one.powers),
        degree=one.powers[-1],
        intercept=one.powers[0] == 0,
        coefficients=tuple(
            Coefficient(
                power=power,
                unit="N" if power == 0 else f"N/mm^{power}".removesuffix("^1"),
                value=float(one.coefficients[i]),
                standard_error=float(errors[i]),
                lo=float(ends[0, i]),
                hi=float(ends[1, i]),
            )
            for i, power in enumerate(one.powers)
        ),
        polyfit_order=_highest_first(one),
        s_N=one.s,
        dof=one.dof,
        r2=one.r2,
        r2_adjusted=one.r2_adjusted,
        aicc=one.aicc,
        aicc_over_best=None if one.aicc is None or best is None else one.aicc - best,
        lack_of_fit=one.lack_of_fit,
        held_out_rows_N=one.held_out,
        held_out_runs_N=one.held_out_runs,
        condition_number=one.condition_number,
        at=None
        if at is None
        else ForceAt(**{f"{name}_N": value for name, value in one.at(at).items()}),
    )


def _highest_first(one: PolynomialFit) -> tuple[float, ...]:
    """Return the coefficients as polyfit and polyval order them, highest first."""
    full = np.zeros(one.powers[-1] + 1)
    full[list(one.powers)] = one.coefficients
    return tuple(full[::-1].tolist())


def _beside(models: Pooled, at: float | None) -> BayesianAnswer:
    return BayesianAnswer(
        interval_kind="equal-tailed credible interval",
        theory=models.theory,
        effects=tuple(effect.name for effect in models.effects),
        with_gap=models.with_gap,
        stiffness_N_per_mm=credible_interval(models.values["stiffness"]),
        sigma_N=credible_interval(models.values["sigma"]),
        at=None if at is None else _predicted(models, at),
    )


def _averaging(models: Pooled | None) -> list[str]:
    return [] if models is None else averaging_words(models.causes)


def _predicted(models: Pooled, at: float) -> BayesianForceAt:
    weighed = [(one.probability, one.posterior) for one in models.causes]
    bands = {n: v[0].item() for n, v in predict(weighed, [at]).columns().items()}
    return BayesianForceAt(
        force_N=bands["physics_median_N"],
        lo_N=bands["physics_lo_N"],
        hi_N=bands["physics_hi_N"],
        reading_lo_N=bands["new_measurement_lo_N"],
        reading_hi_N=bands["new_measurement_hi_N"],
        temperature_C=bands["temperature_C"],
        tested=bands["tested"],
    )
