"""Classical fits in words: the numbers of a curve-fitting tool, with errors."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from hdcal.classical.fit.answer import FitAnswer, FittedCurve, ForceAt
from hdcal.classical.fit.fit import DOUBT
from hdcal.classical.fit.notation import omega
from hdcal.data.case import Case
from hdcal.report.document import Document, Picture, Section, Table, Text, notices
from hdcal.report.parameters import Interval
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.words import estimate, newton, number


def headline(curves: Sequence[FittedCurve]) -> str:
    """Return which curve describes the data best, in one sentence."""
    ranked = [one for one in curves if one.aicc is not None]
    if len(ranked) < 2:
        return f"{len(curves)} curve{'s' * (len(curves) > 1)} fitted by least squares."
    best = min(ranked, key=lambda one: one.aicc or 0.0)
    close = [one.model for one in ranked if 0.0 < (one.aicc_over_best or 0.0) < 2.0]
    also = f", and {' and '.join(close)} no worse by a clear margin" if close else ""
    return f"Of these, {best.model} describes the data best (AICc){also}."


# Degree of a curve that leaves of readings what no bend is.
_SMOOTH = 3


def notes(case: Case) -> Iterator[str]:
    """Yield what the curves leave out of account."""
    records = case.records
    cold, warm = np.min(records.temperature), np.max(records.temperature)
    if warm - cold > 1.0:
        yield (
            f"the temperature went from {cold:g} to {warm:g} °C: no curve here knows it"
        )
    sense = np.asarray(records.sense)
    if np.any(sense > 0.0) and np.any(sense < 0.0):
        x, force = np.asarray(records.deformation), np.asarray(records.force)
        error = force - np.polyval(np.polyfit(x, force, _SMOOTH), x)
        loop = newton(abs(float(error[sense > 0.0].mean() - error[sense < 0.0].mean())))
        yield (
            f"loading and unloading are fitted as one curve: they lie {loop} apart in "
            "the mean, which counts as scatter here"
        )
    for kind, labels in (("run", case.run_labels), ("gear", case.specimen_labels)):
        if len(labels) > 1:
            yield (
                f"{len(labels)} {kind}s are fitted as one: errors within a {kind} are "
                "then not independent, and intervals are too narrow"
            )
    if np.any(records.force_sd):
        yield "the stated errors of the rows (force_sd) are not used as weights"


def fit_document(case: Case, found: FitAnswer, command: str = "") -> Document:
    """Return the report of classical fits; its picture is called fit."""
    lacking = [
        one.model
        for one in found.fits
        if one.lack_of_fit is not None and one.lack_of_fit.too_simple
    ]
    sections = [
        _picture(),
        _coefficients(found),
        _quality(found),
        _too_simple(found),
        *([] if found.at_mm is None else [_compared(found)]),
    ]
    provenance = [*gear_rows(case, case.gear.theory), *data_rows(case)]
    return Document(
        name=found.data.gear,
        kind="classical fits",
        subtitle=f"least-squares polynomials on {found.data.rows} rows "
        f"({found.data.name})",
        headline=found.headline,
        answers=[f"Too simple for these data: {'; '.join(lacking)}."] * bool(lacking),
        notices=notices(("To be aware of", found.notes)),
        sections=sections,
        provenance=provenance + ([("command", command)] if command else []),
    )


def _picture() -> Section:
    caption = "Above the readings with every curve; below what each leaves over."
    return Section("Data and curves", [Picture("fit", "Data and curves", caption)])


def _coefficients(found: FitAnswer) -> Section:
    rows = []
    for one in found.fits:
        first = one.model
        for item in one.coefficients:
            value, span = estimate(Interval(item.value, item.lo, item.hi))
            error = number(item.standard_error)
            term = omega(item.power) if item.power else "c"
            rows.append([first, term, value, error, span, item.unit])
            first = ""
    numbers = ("value", "standard error", "95 % confidence interval")
    table = Table(["curve", "term", *numbers, "unit"], rows, frozenset(numbers))
    lists = [
        Text(f"polyval([{' '.join(f'{c:.6g}' for c in one.polyfit_order)}], w)", True)
        for one in found.fits
    ]
    lead = Text("The same for polyval, highest power first:", soft=True)
    heading = "Coefficients (deformation ω in mm, force in N)"
    return Section(heading, [table, lead, *lists], brief=True)


def _quality(found: FitAnswer) -> Section:
    runs = any(one.held_out_runs_N is not None for one in found.fits)
    numbers = ["s [N]", "R²", "adjusted R²", "AICc", "one row out [N]"]
    numbers += ["one run out [N]"] * runs + ["condition"]
    rows = [
        [
            one.model,
            number(one.s_N),
            _r2(one.r2),
            _r2(one.r2_adjusted),
            "–" if one.aicc is None else f"{one.aicc:.1f}",
            number(one.held_out_rows_N),
            *([number(one.held_out_runs_N)] if runs else []),
            number(one.condition_number),
        ]
        for one in found.fits
    ]
    words = (
        "s: scatter of the readings about the curve. AICc: smaller is better, by 2 or "
        "more to matter. One row out: typical error on a reading that the curve was "
        "not fitted to. R² is about the mean force for every curve, also through the "
        "origin; on a ramp it is near 1 for any rising curve."
    )
    table = Table(["curve", *numbers], rows, frozenset(numbers))
    return Section("How well each curve fits", [table, Text(words, soft=True)], True)


def _r2(value: float | None) -> str:
    return "–" if value is None else f"{value:.5f}"


def _too_simple(found: FitAnswer) -> Section:
    rows = [_lack_row(one) for one in found.fits]
    kinds = {one.lack_of_fit.against for one in found.fits if one.lack_of_fit}
    words = [f"A curve is called too simple where p is below {DOUBT:g}."]
    if "next degree" in kinds:
        words.append(
            "No conditions were repeated, so that the scatter of repeats is not known: "
            "each curve is compared with the next degree instead, which sees curvature "
            "of that kind only."
        )
    columns = ["curve", "verdict", "compared with", "F", "p"]
    table = Table(columns, rows, frozenset({"F", "p"}))
    said = [Text(sentence, soft=True) for sentence in words]
    return Section("Is the curve too simple?", [table, *said], brief=True)


def _lack_row(one: FittedCurve) -> list[str]:
    lack = one.lack_of_fit
    if lack is None:
        return [one.model, "cannot be tested", "–", "–", "–"]
    words = "too simple" if lack.too_simple else "no sign of lack of fit"
    against = {
        "pure error": "repeated rows",
        "next degree": f"degree {one.degree + 1}",
    }[lack.against]
    ratio = f"F({lack.dof[0]}, {lack.dof[1]}) = {number(lack.F)}"
    return [one.model, words, against, ratio, f"{lack.p_value:.2g}"]


def _compared(found: FitAnswer) -> Section:
    rows = [
        [one.model, *_at(one.at), "confidence, prediction"]
        for one in found.fits
        if one.at is not None
    ]
    words = []
    other = found.bayesian
    if other is not None and other.at is not None:
        rows.append(["calibration (Bayesian)", *_at(other.at), "credible, predictive"])
        middle, span = estimate(other.stiffness_N_per_mm)
        words.append(
            f"The calibration's stiffness is {middle} N/mm, 95 % credible interval "
            f"{span} N/mm: to be compared with the slope of c + a ω."
        )
        if not other.at.tested:
            words.append("This deformation or temperature was not tested.")
    words.append(
        "A confidence interval would hold the true value in 95 % of repeated tests if "
        "the curve is right; a credible interval holds it with 95 % probability, given "
        "these data, the model and the priors."
    )
    numbers = ["force [N]", "95 % interval [N]", "one more reading [N]"]
    columns = ["answer", *numbers, "kind of interval"]
    said = [Text(sentence, soft=True) for sentence in words]
    table = Table(columns, rows, frozenset(numbers))
    return Section(f"Force at {found.at_mm:g} mm", [table, *said], brief=True)


def _at(at: ForceAt) -> list[str]:
    force, span = estimate(Interval(at.force_N, at.lo_N, at.hi_N))
    reading = Interval(math.nan, at.reading_lo_N, at.reading_hi_N)
    return [force, span, estimate(reading)[1]]
