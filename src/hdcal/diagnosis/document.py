"""The report of a diagnosis: one HTML page that needs nothing else."""

from collections.abc import Iterator

from hdcal.calibration.summary import summarise
from hdcal.diagnosis.verdict import Verdict
from hdcal.diagnosis.words import held_out, one_reading
from hdcal.inference.posterior import Posterior
from hdcal.report.page import parameter_row, render_page
from hdcal.report.provenance import data_rows, gear_rows
from hdcal.report.words import (
    estimate,
    hypothesis,
    likely,
    newton,
    number,
    percent,
    percent_span,
)

_TEMPLATE = "verdict.html.j2"
_MOST_ROWS = 12


def verdict_report(
    verdict: Verdict,
    found: dict,
    images: dict[str, bytes],
    command: str = "",
    refit: tuple[str, Posterior] | None = None,
) -> str:
    """Return the report as the text of an HTML file.

    Args:
        verdict: from `diagnose`.
        found: the same as plain data.
        images: SVG files named where, which, shrink and, with a refit, bands.
        command: how the result was made.
        refit: hypothesis and posterior of the corrected model.
    """
    regions = found["where"]["regions"]
    chances = found["which"]["probabilities"]
    shares = found["where"]["shares"]
    context = {
        "kind": "diagnosis",
        "found": found,
        "failed": found["status"] != "ok",
        "name": verdict.case.gear.name,
        "gap": _gap(found),
        "regions": [_region(cell) for cell in regions[:_MOST_ROWS]],
        "hidden": max(len(regions) - _MOST_ROWS, 0),
        "shares": [(s["covariate"], percent_span(s["share"])) for s in shares],
        "hypotheses": _hypotheses(found["which"]),
        "others": max(len(chances) - _MOST_ROWS, 0),
        "robustness": list(_robustness(found["which"])),
        "closed": _closed(found["shrink"]),
        "runs": [_run(run) for run in found["next_test"]],
        "K": _K(found["budget"]),
        "budget": [_part(part) for part in found["budget"]["parts"]],
        "refit": refit and _refit(*refit),
        "data_rows": data_rows(verdict.case),
        "provenance": _provenance(verdict, found, command),
    }
    return render_page(_TEMPLATE, context, images)


def _gap(found: dict) -> list[tuple[str, str, str]]:
    gap, p = found["gap"], found["where"]["p_value"]
    chance = f"p = {number(p)}"
    words = "a gap is seen" if gap["detected"] else "no gap is seen"
    seen = ("seen", chance, f"{words}; how often noise alone looks like this")
    if gap["rounding_N"] is not None:
        steps = f"in steps of {newton(gap['rounding_N'])}"
        seen = ("seen", "rounding", f"{steps}; nothing else is seen ({chance})")
    noise = f"standard deviation of {one_reading(found)}"
    return [
        seen,
        ("probability", percent(gap["probability"]), "that anything is missing"),
        *_size(gap),
        ("noise", newton(gap["noise_sd_N"]), noise),
    ]


def _size(gap: dict) -> list[tuple[str, str, str]]:
    if gap["rms_N"]["median"] is None:
        return [("size", "–", "of what is not seen there is no size")]
    middle, span = estimate(gap["rms_N"])
    share = percent(gap["share_of_full_scale"])
    return [
        ("size", f"{middle} N", f"root mean square; 90 % interval {span} N"),
        ("of full scale", share, "size over the largest force tested"),
    ]


def _region(cell: dict) -> dict:
    bias = cell["bias_N"]
    width = None if bias["hi"] is None else bias["hi"] - bias["lo"]
    return {
        "covariate": cell["covariate"],
        "label": cell["label"],
        "rows": str(cell["rows"]),
        "bias": number(bias["median"], width),
        "z": number(cell["z"], 10.0),
        "share": percent(cell["share"]),
    }


def _hypotheses(which: dict) -> list[dict]:
    chances, evidence = which["probabilities"], which["log_evidence"]
    together = likely(chances)
    ranked = sorted(chances, key=lambda name: -(chances[name] or 0.0))
    return [
        {
            "words": hypothesis(name),
            "chance": percent(chances[name]),
            "evidence": number(evidence.get(name), 10.0),
            "likely": name in together,
        }
        for name in ranked[:_MOST_ROWS]
    ]


def _robustness(which: dict) -> Iterator[str]:
    if which["sensitivity"]:
        texts = [
            f"{percent(value)} ({name.replace('_', ' ')})"
            for name, value in which["sensitivity"].items()
        ]
        yield (
            "With other beliefs about the size of effects, the first cause would have "
            f"{', '.join(texts)}."
        )
    if which["stability"] is not None:
        share = percent(which["stability"])
        yield f"With other readings of the same kind, the ranking's top stays: {share}."


def _closed(shrink: dict) -> list[tuple[str, str]]:
    if shrink["closed"] is None:
        return []
    rows = [(f"closed on {held_out(shrink)}", percent_span(shrink["closed"]))]
    for name, key in (
        ("with the largest deformations held out", "extrapolated_closed"),
        ("by a free curve instead (placebo)", "placebo_closed"),
    ):
        if shrink[key] is not None:
            rows.append((name, percent(shrink[key])))
    rows += [(f"by {hypothesis(n)}", percent(v)) for n, v in shrink["bars"].items()]
    if shrink["remainder_N"] is not None:
        middle, span = estimate(shrink["remainder_N"])
        rows.append(("left after it", f"{middle} N, 90 % interval {span} N"))
    return rows


def _run(run: dict) -> dict:
    return {
        "run": run["run"],
        "separates": ", ".join(map(hypothesis, run["separates"])),
        "information": number(run["information_nats"], 1.0),
        "cost": run["cost"],
    }


def _K(budget: dict) -> str:
    middle, span = estimate(budget["K"])
    return (
        f"K by the {budget['formula']} formula, at the prior's mean modulus, is "
        f"{middle}, 90 % interval {span}."
    )


def _part(part: dict) -> dict:
    middle, span = estimate(part["factor"])
    return {
        "name": part["name"],
        "factor": middle,
        "span": span,
        "prior": " : ".join(estimate(part["prior"])),
        "driven_by": part["driven_by"],
        "split_by": part["split_by"],
    }


def _refit(name: str, posterior: Posterior) -> dict:
    entries = summarise(posterior)["parameters"].items()
    return {
        "effects": hypothesis(name),
        "failed": not posterior.usable,
        "parameters": [parameter_row(n, entry) for n, entry in entries],
    }


def _provenance(verdict: Verdict, found: dict, command: str) -> list[tuple[str, str]]:
    rows = [
        *gear_rows(verdict.case, verdict.case.gear.theory),
        ("library", ", ".join(found["library"])),
        ("seed", str(found["seed"])),
        ("versions", ", ".join(f"{k} {v}" for k, v in found["versions"].items())),
        *(("note", note) for note in found["notes"]),
    ]
    return rows + ([("command", command)] if command else [])
