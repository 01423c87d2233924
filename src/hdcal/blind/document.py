"""The report of a blind check, and everything that its scores leave behind."""

from pathlib import Path
from typing import Any

from hdcal.blind.figure import (
    bar_figure,
    confusion_figure,
    detection_figure,
    reliability_figure,
)
from hdcal.blind.words import (
    bar_row,
    limit_row,
    shown,
    span,
    truth_word,
    with_span,
)
from hdcal.report.canvas import render
from hdcal.report.page import render_page
from hdcal.report.plain import as_json, as_plain

_TEMPLATE = "blind.html.j2"
_TITLE = "Blind check"
# key, heading and unit of the numbers in the tables of groups
_FIRST = (
    ("top1", "true effect first", "share"),
    ("oracle", "oracle", "share"),
    ("family", "true family first", "share"),
    ("set_holds", "set holds it", "share"),
    ("set_size", "size of set", "effects"),
    ("detected", "detected", "share"),
    ("false_alarms", "false alarms", "share"),
    ("precision", "names right", "share"),
    ("log_score", "log score [nat]", "nat"),
)
_SIZES = (
    ("amplitude", "error of amplitude", "share"),
    ("amplitude_holds", "interval holds it", "share"),
    ("gap", "error of gap", "share"),
    ("gap_holds", "interval holds it", "share"),
    ("closed", "error of closed share", "points"),
)
_RIVALS = (
    ("top1_r1", "true effect first, r = 1", "share"),
    ("top1_r0.5", "r = 0.5", "share"),
    ("top1", "all r", "share"),
    ("false_alarms", "false alarms", "share"),
    ("precision", "names right", "share"),
    ("log_score", "log score [nat]", "nat"),
    ("brier", "Brier score", "nat"),
)
_PAIRS = (
    ("pair_first", "the pair is the most probable hypothesis"),
    ("both_in_set", "both are in the 90 % set"),
    ("both_named", "both are named"),
    ("one_named_wrong", "an effect is named that does not act"),
)


def write_scores(found: dict[str, Any], folder: Path) -> None:
    """Write scores.json, the figures and report.html.

    Args:
        found: from `hdcal.blind.scoring.scores.score`.
        folder: one that exists, from `whole_folder`.
    """
    plain = as_plain(found)
    (folder / "scores.json").write_text(as_json(plain), "utf-8")
    drawn = {
        "bar": bar_figure(plain["bar"]),
        "confusion": confusion_figure(plain["confusion"]),
        "reliability": reliability_figure(plain["reliability"]),
        "detection": detection_figure(plain["detection"]),
    }
    images = {n: render(f, "svg", f"{_TITLE}: {n}") for n, f in drawn.items()}
    for name, figure in drawn.items():
        (folder / f"{name}.svg").write_bytes(images[name])
        png = render(figure, "png", f"{_TITLE}: {name}")
        (folder / f"{name}.png").write_bytes(png)
    page = blind_report(plain, images).encode("utf-8", "xmlcharrefreplace")
    (folder / "report.html").write_bytes(page)


def blind_report(found: dict[str, Any], images: dict[str, bytes]) -> str:
    """Return the report as the text of an HTML file.

    Args:
        found: scores as plain data.
        images: SVG files named bar, confusion, reliability and detection.
    """
    rows = [bar_row(row) for row in found["bar"]]
    groups = {
        "size of the gap": found["by_r"],
        "program": found["by_program"],
        "noise": found["by_noise"],
        "effect": found["by_effect"],
        "family": found["by_family"],
    }
    context = {
        "kind": "scores",
        "failed": False,
        "name": _TITLE,
        "found": found,
        "kinds": ", ".join(f"{n} {k}" for k, n in found["cases"]["kinds"].items()),
        "bar": rows,
        "missed": [row["what"] for row in rows if row["word"].startswith("missed")],
        "rivals": _table(_rivals(found), _RIVALS),
        "groups": [(name, _table(lines, _FIRST)) for name, lines in groups.items()],
        "sizes": _table(found["by_r"], _SIZES),
        "limits": [limit_row(curve) for curve in found["detection"]],
        "mix_ups": [_mix_up(row) for row in found["mix_ups"]],
        "calibration": _calibration(found["reliability"]),
        "pairs": [(words, with_span(found["pairs"][key])) for key, words in _PAIRS],
        "order": _order(found["order"]),
        "notes": list(found["notes"].items()),
    }
    return render_page(_TEMPLATE, context, images)


def _table(lines: list[dict], columns: tuple) -> dict[str, list]:
    return {
        "heads": [words for _, words, _ in columns],
        "rows": [
            {
                "name": line["name"].replace("_", " "),
                "n": str(line["n"]),
                "cells": [_cell(line[key], unit) for key, _, unit in columns],
            }
            for line in lines
        ],
    }


def _cell(entry: dict | None, unit: str) -> tuple[str, str]:
    """Return a number and its interval, which stands below it."""
    if entry is None or entry["value"] is None:
        return "–", ""
    ends = span(entry, unit)
    return shown(entry["value"], unit), ends if ends != "–" else ""


def _rivals(found: dict) -> list[dict]:
    return [
        {**row, "brier": found["brier"].get(row["name"])} for row in found["rivals"]
    ]


def _mix_up(row: dict) -> dict[str, str]:
    return {
        "truth": truth_word(row["truth"]),
        "answer": truth_word(row["answer"]),
        "count": f"{row['n']} of {row['of']}",
    }


def _calibration(table: dict) -> list[tuple[str, str]]:
    rows = []
    for key, words in (
        ("top", "most probable hypothesis"),
        ("effects", "single effects given 5 % or more"),
    ):
        entry = table[key]
        floor = entry["floor"]
        rows.append((f"error, {words}", with_span(entry, "points")))
        rows.append((f"before debiasing, {words}", shown(entry["plug_in"], "points")))
        texts = "–"
        if floor is not None:
            mean, high = shown(floor["mean"], "points"), shown(floor["hi"], "points")
            texts = f"{mean} on average, up to {high} in 95 % of such checks"
        rows.append((f"of a perfectly calibrated one, {words}", texts))
    each = [row["value"] for row in table["classwise"] if row["value"] is not None]
    average = sum(each) / len(each) if each else None
    rows.append(("mean over effects, all statements", shown(average, "points")))
    return rows


def _order(found: dict) -> list[tuple[str, str]]:
    rows = [("p-value, that answers do not depend on order", _p(found))]
    for key, words in (
        ("same_as_neighbour", "same answer as the next file"),
        ("truth_of_neighbour", "answer is the truth of a neighbour"),
        ("truth_itself", "same truth as the next file (how well it was shuffled)"),
    ):
        if key in found:
            entry = found[key]
            texts = f"{entry['seen']}, expected {entry['expected']:.0f}"
            rows.append((words, f"{texts}, p = {shown(entry['p_value'], 'p')}"))
    for key, words in (("first", "first half"), ("second", "second half")):
        rows.append((f"right in the {words}", with_span(found[f"{key}_half_right"])))
    return rows


def _p(found: dict) -> str:
    return shown(found["p_value"], "p")
