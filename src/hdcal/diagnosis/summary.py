"""A verdict as its JSON answer, and all that its result folder holds."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from hdcal.diagnosis.answer import DiagnosedData, Refit, VerdictAnswer, WhereAnswer
from hdcal.diagnosis.document import verdict_document
from hdcal.diagnosis.verdict import Verdict, Which
from hdcal.diagnosis.words import answer, headline, limits, next_step
from hdcal.inference.model_average import ModelAverage
from hdcal.inference.posterior import Posterior
from hdcal.inference.posterior_file import FILE_NAME
from hdcal.inference.residuals import residuals
from hdcal.prediction.bands.bands import Bands, default_bands
from hdcal.prediction.engine.pooled import pool
from hdcal.report.chart_spec import Chart
from hdcal.report.intervals import INTERVAL, Interval, credible_interval
from hdcal.report.posterior_answer import CalibratedGear
from hdcal.report.write import Report, report_files, write_files, write_numbers
from hdcal.versions import versions


def verdict_answer(verdict: Verdict) -> VerdictAnswer:
    """Return a verdict as its JSON answer."""
    case, gear, where = verdict.case, verdict.case.gear, verdict.where
    found = VerdictAnswer(
        status=verdict.status,
        reasons=verdict.reasons,
        headline="",
        next_step=None,
        answer=(),
        limits=(),
        interval=INTERVAL,
        gap=verdict.gap,
        seen=verdict.seen,
        where=WhereAnswer(
            where.p_value, where.statistics, where.shares, where.regions, where.cells
        ),
        which=_which(verdict),
        shrink=verdict.shrink,
        next_test=verdict.next_test,
        next_test_reason=verdict.no_run,
        budget=verdict.budget,
        refits=tuple(Refit(name, share) for name, (share, _) in _ranked(verdict)),
        left_out=verdict.left_out,
        stiffness_N_per_mm=_stiffness(verdict),
        units=case.units,
        library=verdict.library,
        notes=verdict.notes,
        seed=verdict.seed,
        quick=verdict.quick,
        versions=versions(),
        gear=CalibratedGear(gear.name, gear.material, gear.theory),
        data=DiagnosedData(
            name=case.name,
            rows=len(case.records.force),
            averaged_rows=verdict.averaged_rows,
            row_step=verdict.row_step,
            rows_diagnosed=len(where.records.force),
            sha256=case.data_sha256,
            notes=case.notes,
        ),
    )
    # The sentences are about all of the numbers.
    return replace(
        found,
        headline=headline(found),
        next_step=next_step(found),
        answer=tuple(answer(found)),
        limits=tuple(limits(found)),
    )


def _which(verdict: Verdict) -> Which:
    """Return the cause, its size in the unit of what was measured."""
    which = verdict.which
    if which.amplitude is None:
        return which
    unit = verdict.case.units.unit(which.amplitude.unit)
    return replace(which, amplitude=replace(which.amplitude, unit=unit))


def _stiffness(verdict: Verdict) -> Interval | None:
    """Return the stiffness as read, hypotheses weighed by their probabilities."""
    if verdict.reasons or not verdict.posteriors:
        return None
    return credible_interval(pool(verdict).values["stiffness"])


def verdict_report(verdict: Verdict, command: str = "") -> Report[VerdictAnswer]:
    """Return all that `hdcal diagnose` leaves behind for one case."""
    refit = corrected(verdict)
    found = verdict_answer(verdict)

    @cache
    def bands() -> Bands:
        return default_bands(list(verdict.posteriors.values()))

    @cache
    def bands_chart() -> Chart:
        from hdcal.calibration.charts import calibration_chart

        assert refit is not None
        fit = refit[1]
        chart = calibration_chart(fit, bands(), residuals(fit))
        return replace(chart, failed=not fit.usable)

    def figures():
        from hdcal.diagnosis.figure.closure import shrink_figure
        from hdcal.diagnosis.figure.where import where_figure
        from hdcal.diagnosis.figure.which import which_figure
        from hdcal.report.chart_drawing import draw

        drawn = {
            "where": where_figure(verdict),
            "which": which_figure(verdict),
            "shrink": shrink_figure(verdict),
        }
        if refit is not None:
            drawn["bands"] = draw(bands_chart())
        return drawn

    def charts():
        from hdcal.diagnosis.chart import where_charts

        # Of a failed fit there is the marked figure alone.
        made: dict[str, Any] = {}
        if verdict.status == "ok":
            made["where"] = where_charts(verdict)
        if refit is not None and refit[1].usable:
            made["bands"] = bands_chart()
        return made

    return Report(
        verdict_document(found, verdict.case, command, refit),
        found,
        "verdict.json",
        figures,
        tables=lambda: {} if refit is None else {"bands.csv": bands().columns()},
        others=lambda: _models(verdict),
        charts=charts,
        theory=found.gear.theory,
    )


def write_verdict(
    verdict: Verdict, folder: Path, command: str = "", *, report: bool = True
) -> VerdictAnswer:
    """Write what `hdcal diagnose` leaves behind for one case, and return the answer.

    Args:
        verdict: from `diagnose`.
        folder: an empty one, from `Target.filled`.
        command: how the result was made, for its provenance.
        report: whether figures and report are wanted; they take most of the time.
    """
    told = verdict_report(verdict, command)
    write_numbers(told, folder)
    if report:
        files = report_files(told.document, told.figures(), None, told.charts())
        write_files(files, folder)
    return told.answer


def _ranked(verdict: Verdict) -> list[tuple[str, tuple[float, Posterior]]]:
    """Return the calibrated models by hypothesis, the most probable first."""
    return sorted(verdict.posteriors.items(), key=lambda item: -item[1][0])


def corrected(verdict: Verdict) -> tuple[str, Posterior] | None:
    """Return the most probable corrected model with its name."""
    weighed = verdict.posteriors
    if not weighed:
        return None
    name = max(weighed, key=lambda name: weighed[name][0])
    return name, weighed[name][1]


def _models(verdict: Verdict) -> Iterator[tuple[str, bytes]]:
    """Yield the file of the calibrated models, where there are any."""
    if verdict.posteriors:
        average = ModelAverage(verdict.posteriors, verdict.left_out)
        yield FILE_NAME, average.to_netcdf()
