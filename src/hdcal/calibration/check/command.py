"""`hdcal check`: read and validate, compute nothing."""

import click

from hdcal.cli.console import Console
from hdcal.cli.options import case_options, json_option, read_given

SCHEMA = "hdcal.check/1"
_MOST_LISTED = 8


@click.command(short_help="Read DATA only, and say what was understood.")
@case_options
@json_option
@click.pass_obj
def check(console: Console, data, gear, columns, theory):
    """Read DATA and its gear file, and say what was understood."""
    with console.wrong:
        case = read_given(console, data, gear, columns, theory)
    assert case is not None
    found = _describe(case)
    console.table(*_words(found))
    if console.json:
        console.data({"schema": SCHEMA, "status": "ok", **found})
    return 0


def _describe(case) -> dict:
    import numpy as np

    from hdcal.physics.registry import EFFECTS

    records, gear = case.records, case.gear

    def ends(values) -> list[float]:
        return [float(np.min(values)), float(np.max(values))]

    count = {
        word: int(np.count_nonzero(records.direction == sign))
        for word, sign in (("loading", 1), ("holding", 0), ("unloading", -1))
    }
    lacking = {
        name: sorted(effect.needs - records.known) for name, effect in EFFECTS.items()
    }
    return {
        "case": case.name,
        "gear": {
            "name": gear.name,
            "material": gear.material,
            "theory": gear.theory,
            "deformation": gear.reading,
            "reference_temperature_C": gear.reference_temperature,
            "force_resolution_N": gear.force_resolution or None,
        },
        "data": {
            "rows": len(records.force),
            "runs": list(case.run_labels),
            "specimens": list(case.specimen_labels),
            "deformation_mm": ends(records.deformation),
            "force_N": ends(records.force),
            "temperature_C": ends(records.temperature),
            "temperature_measured": "temperature" in records.known,
            "direction": count,
            "known": sorted(records.known),
            "sha256": case.data_sha256,
        },
        "effects": {
            "testable": [name for name, lack in lacking.items() if not lack],
            "not_testable": {name: lack for name, lack in lacking.items() if lack},
        },
        "notes": list(case.notes),
    }


def _words(found: dict):
    from rich import box
    from rich.table import Table
    from rich.text import Text

    from hdcal.report.plain import harmless

    found = harmless(found)
    data, gear = found["data"], found["gear"]
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()

    def add(name: str, words: str) -> None:
        table.add_row(Text(name), Text(words))

    add("gear", f"{gear['name']}, {gear['material']}, theory {gear['theory']}")
    add("rows", str(data["rows"]))
    for what, labels in (("runs", data["runs"]), ("specimens", data["specimens"])):
        if len(labels) > 1:
            rest = ", …" if len(labels) > _MOST_LISTED else ""
            add(what, f"{len(labels)}: {', '.join(labels[:_MOST_LISTED])}{rest}")
    way = f"{gear['deformation']}, as read"
    add("deformation", f"{_span(data['deformation_mm'])} mm ({way})")
    add("force", f"{_span(data['force_N'])} N")
    measured = "" if data["temperature_measured"] else " (not measured: the reference)"
    add("temperature", f"{_span(data['temperature_C'])} °C{measured}")
    moves = [f"{many} {word}" for word, many in data["direction"].items() if many]
    add("direction", ", ".join(moves))
    add("also known", ", ".join(data["known"]) or "–")
    add("effects to test", ", ".join(found["effects"]["testable"]))
    for name, lack in found["effects"]["not_testable"].items():
        add("not testable", f"{name}: needs {', '.join(lack)}")
    for note in found["notes"]:
        add("note", note)
    yield table
    yield Text("The input is in order.")


def _span(ends: list[float]) -> str:
    low, high = (f"{end:g}" for end in ends)
    return low if low == high else f"{low} … {high}"
