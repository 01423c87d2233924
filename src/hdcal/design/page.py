"""The reports of designs and studies: one HTML page each that needs nothing else."""

from hdcal.report.page import render_page
from hdcal.report.provenance import THEORY_WORDS
from hdcal.report.words import estimate, number, unit

_TEMPLATE = "design.html.j2"
# Rows of a study's table on the page; all are in study.csv.
_MOST_ROWS = 200
_HEADINGS = {
    "material": "material",
    "wall_thickness_mm": "wall thickness [mm]",
    "radius_mm": "radius [mm]",
    "length_mm": "length [mm]",
    "load_height_mm": "load height [mm]",
    "deformation_mm": "deformation [mm]",
    "temperature_C": "temperature [°C]",
}
_BALANCE = (
    "Left: force of gear and spring over deformation; they rest where the lines cross. "
    "Right: probability that the gear stays in the window at all temperatures. A soft "
    "spring holds the force, so that every gear finds its own deformation; a stiff one "
    "holds the deformation, and passes on every error of its own."
)
_LIMIT = (
    "Force over the free sizes, the limit, and the design that keeps it with the least "
    "change. Of three sizes and more, the first two at the chosen value of the others."
)
_PROFILE = (
    "The ring that two opposed loads deform: displacement, bending moment and stress "
    "over half a turn. Lines: closed form; dots: the series cut after three terms."
)
_STUDY = (
    "Median force with its band, or as a map over the first two sizes. Where more were "
    "varied, the others are at their middle value."
)


def generator_report(found: dict, images: dict[str, bytes], command: str = "") -> str:
    """Return the report of a wave generator as the text of an HTML file.

    Args:
        found: as plain data, with its answer.
        images: SVG files named design and profile.
        command: how the result was made.
    """
    rows = [
        [
            f"{force['temperature_C']:g} °C",
            *(" : ".join(estimate(force[n])) for n in ("at_lo", "at_middle", "at_hi")),
            *(f"{place[n]:.4g}" for n in ("zero_backlash", "no_jam", "inside")),
        ]
        for force, place in zip(found["force_N"], found["at_temperature"], strict=True)
    ]
    low, high = found["asked"]["window_mm"]
    table = {
        "title": "By temperature",
        "headings": [
            "temperature",
            f"force at {low:g} mm [N]",
            "in the middle [N]",
            f"at {high:g} mm [N]",
            "no backlash",
            "no jam",
            "inside",
        ],
        "rows": rows,
        "note": f"Median : {_band(found)}; probabilities with one set point for all.",
    }
    pictures = [("design", "Spring and gear", _BALANCE), _profile()]
    return _page("elastic wave generator", found, images, command, [table], pictures)


def inverse_report(found: dict, images: dict[str, bytes], command: str = "") -> str:
    """Return the report of an inverse design as the text of an HTML file.

    Args and returns are those of `generator_report`.
    """
    listed = [("tested gear", found["tested"])]
    listed += [
        ("chosen" if one == found["design"] else "considered", one)
        for one in found["candidates"]
    ]
    names = list(found["asked"]["bounds"])
    rows = [
        [
            what,
            one["material"],
            *(
                "as tested"
                if name.removesuffix("_mm") not in one["sizes_mm"]
                else f"{one['sizes_mm'][name.removesuffix('_mm')]:.4g}"
                for name in names
            ),
            " : ".join(estimate(one["force_N"])),
            f"{one['probability']:.4g}",
            " : ".join(estimate(one["stress_MPa"])),
            "–"
            if one["utilisation"] is None
            else f"{100 * one['utilisation']['median']:.3g} %",
            "yes" if one["met"] else "no",
        ]
        for what, one in listed
    ]
    table = {
        "title": "Designs",
        "headings": [
            "",
            "material",
            *(_HEADINGS[name] for name in names),
            "force [N]",
            "keeps the limit",
            "stress [MPa]",
            "of yield",
            "met",
        ],
        "rows": rows,
        "note": f"Median : {_band(found)}.",
    }
    pictures = [("design", "Force and limit", _LIMIT), _profile()]
    return _page("inverse geometry", found, images, command, [table], pictures)


def study_report(found: dict, images: dict[str, bytes], command: str = "") -> str:
    """Return the report of a study as the text of an HTML file.

    Args and returns are those of `generator_report`.
    """
    columns = found["columns"]
    shown = [name for name in _HEADINGS if name in columns]
    count = len(columns["material"])
    rows = []
    for i in range(min(count, _MOST_ROWS)):
        ends = {"median": "median", "lo": "lo", "hi": "hi"}
        force = {k: columns[f"force_{v}_N"][i] for k, v in ends.items()}
        cells = [columns[name][i] for name in shown]
        texts = [c if isinstance(c, str) else f"{c:.6g}" for c in cells]
        rows.append([*texts, *estimate(force), number(columns["stress_MPa"][i])])
    note = f"Band: {_band(found)}. Stress: hoop bending under the load, median."
    if count > _MOST_ROWS:
        note += f" The first {_MOST_ROWS} of {count}; all are in study.csv."
    table = {
        "title": "Designs",
        "headings": [
            *(_HEADINGS[name] for name in shown),
            "force [N]",
            "band [N]",
            "stress [MPa]",
        ],
        "rows": rows,
        "note": note,
    }
    pictures = [("study", "Force", _STUDY)]
    return _page("study", found, images, command, [table], pictures)


def _profile() -> tuple[str, str, str]:
    return "profile", "Shape, moment and stress", _PROFILE


def _band(found: dict) -> str:
    return f"{100 * found['interval']:g} % {found['interval_kind']}"


def _page(kind, found, images, command, tables, pictures) -> str:
    gear = found["gear"]
    theory = f"{gear['theory']} ({THEORY_WORDS.get(gear['theory'], '')})"
    facts = [
        ("gear", gear["name"]),
        ("material", gear["material"]),
        ("theory", theory),
        ("draws", f"{found['draws']} of the {found['basis']}"),
    ]
    if "population" in found:
        facts.append(("about", found["population"]))
    asked = [(_asked(name), _value(v)) for name, v in found.get("asked", {}).items()]
    context = {
        "kind": kind,
        "failed": False,
        "name": gear["name"],
        "prior": found["basis"] == "prior",
        "found": found,
        "tables": tables,
        "pictures": [p for p in pictures if p[0] in images],
        "asked": asked,
        "provenance": facts + ([("command", command)] if command else []),
    }
    return render_page(_TEMPLATE, context, images)


def _asked(name: str) -> str:
    words, _, last = name.rpartition("_")
    known = {"mm": "mm", "C": "°C", "N": "N", "MPa": "MPa"}
    if last not in known:
        return name.replace("_", " ")
    return f"{words.replace('_', ' ')} [{unit(known[last])}]"


def _value(value) -> str:
    if value is None:
        return "–"
    if isinstance(value, dict):
        ranges = (f"{n.replace('_', ' ')} {_value(v)}" for n, v in value.items())
        return "; ".join(ranges) or "–"
    if isinstance(value, list):
        return " … ".join(f"{v:g}" for v in value)
    return f"{value:g}"
