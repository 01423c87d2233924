"""A margin as an answer, and all that its result folder holds."""

from dataclasses import fields
from datetime import date

import numpy as np

from hdcal.inference.posterior import Posterior
from hdcal.prediction.margin.answer import DataUsed, MarginAnswer
from hdcal.prediction.margin.document import CALIBRATION_SHARE, whole_document
from hdcal.prediction.margin.result import Margin
from hdcal.prediction.margin.sentences import answer, headline, next_steps
from hdcal.prediction.margin.stated import BudgetLine
from hdcal.report.posterior_answer import CalibratedGear
from hdcal.report.write import Report
from hdcal.versions import versions

KINDS = {
    "force_N": "mean of the population, equal-tailed credible interval",
    "member_N": "one future member, equal-tailed predictive interval",
    "lower_bound_N": "one-sided bound, content and confidence",
    "upper_bound_N": "one-sided bound, content and confidence",
    "capacity_N": "quantile of the population, with the stated confidence",
    "capacity_median_N": "quantile of the population, median over the draws",
    "capacity_predictive_N": "quantile of the predictive distribution",
    "exceedance": "of one future member; lo and hi: credible interval of the share",
}


def margin_answer(
    found: Margin, posterior: Posterior, *, seed: int = 0
) -> MarginAnswer:
    """Return a margin as an answer, ready for JSON."""
    gear, case = posterior.case.gear, posterior.case
    return MarginAnswer(
        reasons=(),
        headline=headline(found),
        next_step=next(next_steps(found), None),
        answer=tuple(answer(found)),
        **vars(found),
        shares_note=CALIBRATION_SHARE,
        kinds={found.units.key(name): kind for name, kind in KINDS.items()},
        seed=seed,
        versions=versions(),
        gear=CalibratedGear(gear.name, gear.material, posterior.theory),
        data=DataUsed(case.name, len(case.records.force), case.data_sha256),
    )


def budget_columns(found: Margin) -> dict[str, np.ndarray]:
    """Return the columns of budget.csv."""
    names = [field.name for field in fields(BudgetLine)]
    key = found.units.key
    return {
        key(n): np.array([getattr(line, n) for line in found.budget]) for n in names
    }


def margin_report(
    found: Margin,
    posterior: Posterior,
    command: str = "",
    *,
    seed: int = 0,
    certificate: date | None = None,
) -> Report[MarginAnswer]:
    """Return all that `hdcal margin` leaves behind.

    Args:
        found: the margin.
        posterior: of the likeliest cause.
        command: that made it.
        seed: likewise.
        certificate: date of issue of a certificate, or None without one.

    Raises:
        NotUsable: a certificate of a calibration that failed its checks.
    """

    def figures():
        from hdcal.prediction.margin.figure import margin_figures

        return margin_figures(found, posterior.case.gear.name)

    def charts():
        from hdcal.prediction.margin.chart import margin_chart

        return {"margin": [margin_chart(found)]} if len(found.levels) > 1 else {}

    answer = margin_answer(found, posterior, seed=seed)
    document = whole_document(answer, posterior, command)
    others = []
    if certificate is not None:
        from hdcal.prediction.margin.certificate import FILE, certificate_page

        page = certificate_page(answer, posterior, certificate)
        others.append((FILE, page.encode("utf-8", "xmlcharrefreplace")))
    tables = {"budget.csv": budget_columns(found)} if found.budget else {}
    return Report(
        document,
        answer,
        "margin.json",
        figures,
        tables=lambda: tables,
        others=lambda: others,
        charts=charts,
        theory=posterior.theory,
    )
