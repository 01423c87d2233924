"""A verdict as its JSON answer."""

from dataclasses import replace

from hdcal.diagnosis.answer import (
    AmplitudeAnswer,
    CellAnswer,
    DiagnosedData,
    NotTestable,
    Refit,
    VerdictAnswer,
    WhereAnswer,
    WhichAnswer,
)
from hdcal.diagnosis.verdict import Cell, Verdict, Where, Which, member_files
from hdcal.diagnosis.words import answer, headline, limits, next_step
from hdcal.inference.posterior import versions
from hdcal.report.parameters import Interval
from hdcal.report.posterior_answer import CalibratedGear

INTERVAL = 0.9


def verdict_answer(
    verdict: Verdict, *, seed: int = 0, quick: bool = False
) -> VerdictAnswer:
    """Return a verdict as its JSON answer.

    Args:
        verdict: from `diagnose`.
        seed: it was made with.
        quick: whether nothing was sampled.
    """
    case, gear = verdict.case, verdict.case.gear
    found = VerdictAnswer(
        status=verdict.status,
        reasons=verdict.reasons,
        headline="",
        next_step=None,
        answer=(),
        limits=(),
        interval=INTERVAL,
        gap=verdict.gap,
        where=_where(verdict.where),
        which=_which(verdict.which),
        shrink=verdict.shrink,
        next_test=verdict.next_test,
        next_test_reason=verdict.no_run,
        budget=verdict.budget,
        refits=tuple(
            Refit(name, verdict.posteriors[name][0], file)
            for name, file in member_files(verdict).items()
        ),
        library=verdict.library,
        notes=verdict.notes,
        seed=seed,
        quick=quick,
        versions=versions(),
        gear=CalibratedGear(gear.name, gear.material, gear.theory),
        data=DiagnosedData(
            name=case.name,
            rows=len(case.records.force),
            averaged_rows=verdict.averaged_rows,
            rows_diagnosed=len(verdict.where.records.force),
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


def _where(where: Where) -> WhereAnswer:
    return WhereAnswer(
        p_value=where.p_value,
        statistics=where.statistics,
        shares=where.shares,
        regions=tuple(map(_cell, where.regions)),
        cells=tuple(map(_cell, where.cells)),
    )


def _cell(cell: Cell) -> CellAnswer:
    low, high = cell.bias_N - cell.half_width_N, cell.bias_N + cell.half_width_N
    return CellAnswer(
        covariate=cell.covariate,
        label=cell.label,
        from_=cell.start,
        to=cell.stop,
        unit=cell.unit,
        rows=cell.rows,
        bias_N=Interval(cell.bias_N, low, high),
        z=cell.z,
        share=cell.share,
    )


def _which(which: Which) -> WhichAnswer:
    size, lacking = which.amplitude, which.not_testable.items()
    return WhichAnswer(
        **{
            **vars(which),
            "amplitude": size
            and AmplitudeAnswer(
                **vars(size.size),
                effect=size.effect,
                parameter=size.parameter,
                unit=size.unit,
            ),
            "not_testable": tuple(NotTestable(name, needs) for name, needs in lacking),
        }
    )
