"""Classical fits for a reader: the numbers of a curve-fitting tool, with errors."""

from hdcal.classical.fit.summary import DOUBT, omega
from hdcal.report.sheet import Section, Sheet
from hdcal.report.words import estimate, number

_RIGHT = frozenset(
    {
        "value",
        "standard error",
        "95 % confidence interval",
        "s [N]",
        "R²",
        "adjusted R²",
        "AICc",
        "one row out [N]",
        "one run out [N]",
        "condition",
        "F",
        "p",
        "force [N]",
        "95 % interval [N]",
        "one more reading [N]",
    }
)


def fit_sheet(found: dict) -> Sheet:
    """Return the sheet of `hdcal fit`.

    Args:
        found: from `summarise_fits`.
    """
    data = found["data"]
    sections = [_curves(), _coefficients(found), _quality(found), _too_simple(found)]
    if found["at_mm"] is not None:
        sections.append(_compared(found))
    return Sheet(
        name=data["gear"],
        kind="classical fits",
        subtitle=f"least-squares polynomials on {data['rows']} rows ({data['name']})",
        answers=_answers(found),
        warnings=found["notes"],
        sections=sections,
    )


def _curves() -> Section:
    return Section(
        "Data and curves",
        image="fit",
        caption="Above the readings with every curve; below what each leaves over.",
    )


def _coefficients(found: dict) -> Section:
    rows = []
    for one in found["fits"]:
        first = one["model"]
        for item in one["coefficients"]:
            value, span = estimate({**item, "median": item["value"]})
            error = number(item["standard_error"])
            term = omega(item["power"]) if item["power"] else "c"
            rows.append([first, term, value, error, span, item["unit"]])
            first = ""
    lists = [
        f"polyval([{' '.join(f'{c:.6g}' for c in one['polyfit_order'])}], w)"
        for one in found["fits"]
    ]
    columns = ["curve", "term", "value", "standard error", "95 % confidence interval"]
    return Section(
        "Coefficients (deformation ω in mm, force in N)",
        [*columns, "unit"],
        rows,
        _RIGHT,
        ["The same for polyval, highest power first:", *lists],
    )


def _quality(found: dict) -> Section:
    runs = any(one["held_out_runs_N"] is not None for one in found["fits"])
    columns = ["curve", "s [N]", "R²", "adjusted R²", "AICc", "one row out [N]"]
    columns += ["one run out [N]"] * runs + ["condition"]
    rows = [
        [
            one["model"],
            number(one["s_N"]),
            _r2(one["r2"]),
            _r2(one["r2_adjusted"]),
            "–" if one["aicc"] is None else f"{one['aicc']:.1f}",
            number(one["held_out_rows_N"]),
            *([number(one["held_out_runs_N"])] if runs else []),
            number(one["condition_number"]),
        ]
        for one in found["fits"]
    ]
    words = [
        "s: scatter of the readings about the curve. AICc: smaller is better, by 2 or "
        "more to matter. One row out: typical error on a reading that the curve was "
        "not fitted to. R² is about the mean force for every curve, also through the "
        "origin; on a ramp it is near 1 for any rising curve.",
    ]
    return Section("How well each curve fits", columns, rows, _RIGHT, words)


def _r2(value: float | None) -> str:
    return "–" if value is None else f"{value:.5f}"


def _too_simple(found: dict) -> Section:
    rows, kinds = [], set()
    for one in found["fits"]:
        lack = one["lack_of_fit"]
        if lack is None:
            rows.append([one["model"], "cannot be tested", "–", "–", "–"])
            continue
        kinds.add(lack["against"])
        words = "too simple" if lack["too_simple"] else "no sign of lack of fit"
        against = {
            "pure error": "repeated rows",
            "next degree": f"degree {one['degree'] + 1}",
        }[lack["against"]]
        ratio = f"F({lack['dof'][0]}, {lack['dof'][1]}) = {number(lack['F'])}"
        rows.append([one["model"], words, against, ratio, f"{lack['p_value']:.2g}"])
    words = [f"A curve is called too simple where p is below {DOUBT:g}."]
    if "next degree" in kinds:
        words.append(
            "No conditions were repeated, so that the scatter of repeats is not known: "
            "each curve is compared with the next degree instead, which sees curvature "
            "of that kind only."
        )
    columns = ["curve", "verdict", "compared with", "F", "p"]
    return Section("Is the curve too simple?", columns, rows, _RIGHT, words)


def _compared(found: dict) -> Section:
    rows = []
    for one in found["fits"]:
        rows.append([one["model"], *_at(one["at"]), "confidence, prediction"])
    words = []
    if found["bayesian"] is not None:
        other = found["bayesian"]
        kind = "credible, predictive"
        rows.append(["calibration (Bayesian)", *_at(other["at"]), kind])
        middle, span = estimate(other["stiffness_N_per_mm"])
        words.append(
            f"The calibration's stiffness is {middle} N/mm, 95 % credible interval "
            f"{span} N/mm: to be compared with the slope of c + a ω."
        )
        if not other["at"]["tested"]:
            words.append("This deformation or temperature was not tested.")
    words.append(
        "A confidence interval would hold the true value in 95 % of repeated tests if "
        "the curve is right; a credible interval holds it with 95 % probability, given "
        "these data, the model and the priors."
    )
    columns = ["answer", "force [N]", "95 % interval [N]", "one more reading [N]"]
    heading = f"Force at {found['at_mm']:g} mm"
    return Section(heading, [*columns, "kind of interval"], rows, _RIGHT, words)


def _at(at: dict) -> list[str]:
    force, span = estimate(
        {"median": at["force_N"], "lo": at["lo_N"], "hi": at["hi_N"]}
    )
    ends = {"median": None, "lo": at["reading_lo_N"], "hi": at["reading_hi_N"]}
    return [force, span, estimate(ends)[1]]


def _answers(found: dict) -> list[str]:
    ranked = [one for one in found["fits"] if one["aicc"] is not None]
    if len(ranked) < 2:
        return []
    best = min(ranked, key=lambda one: one["aicc"])
    close = [one["model"] for one in ranked if 0.0 < one["aicc"] - best["aicc"] < 2.0]
    also = f", and {' and '.join(close)} no worse by a clear margin" if close else ""
    lacking = [
        one["model"]
        for one in found["fits"]
        if one["lack_of_fit"] and one["lack_of_fit"]["too_simple"]
    ]
    words = [f"Of these, {best['model']} describes the data best (AICc){also}."]
    if lacking:
        words.append(f"Too simple for these data: {'; '.join(lacking)}.")
    return words
