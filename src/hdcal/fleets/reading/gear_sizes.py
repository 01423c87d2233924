"""Gears of several sizes: a table that states those of each gear."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.case import Case, Gear
from hdcal.data.findings import FileFindings
from hdcal.data.gear_file.schema import size_faults
from hdcal.data.plausible import implausible
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.cells import has_comma, read_numbers
from hdcal.data.tables.headers import parse_header
from hdcal.data.tables.sources import is_frame, read_source
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, InputError
from hdcal.physics.theory import THEORIES

# Sizes that a table may state, as a gear file names them.
SIZES = ("wall_thickness_mm", "radius_mm", "length_mm", "load_height_mm")
# Words of headers that mean a size.
_SIZE_WORDS = ("wall", "radius", "length", "load_height", "diameter", "thickness")


def gear_sizes(source: Any, case: Case) -> tuple[np.ndarray, dict[str, Finding]]:
    """Return what the sizes of gears make of their stiffness.

    The source is a file or table with a column that names the gear, and columns named
    as `SIZES`; other sizes are those of the gear file.

    Returns:
        Stiffness of the sizes of each gear over that of the sizes in the gear file,
        NaN where it is not known, shape (g,); and the gears without a size.

    Raises:
        InputError: the table or a size is wrong.
    """
    in_memory = is_frame(source)
    if not in_memory and not isinstance(source, str | Path):
        remedy = "Give a path, a DataFrame, or arrays by header"
        raise InputError([Finding("gears", f"is a {type(source).__name__}", remedy)])
    name = "the table of gears" if in_memory else str(source)
    with FileFindings(name) as findings:
        if case.gear.theory == SPRING:
            words = "sizes need a gear file, and none was given"
            findings.refuse(words, "Name one, as `gear` FILE.toml")
        table, _ = read_source(source, findings)
        places, specimen = _columns(table, case, findings)
        sizes = {
            header.removesuffix("_mm"): _numbers(table, header, place, findings)
            for header, place in places.items()
        }
        findings.add_rows(_at_odds(table, sizes, case.gear))
        labels = pd.Series(table.grid.texts(specimen))
        words = "duplicate row for this gear", "Remove one"
        twice = labels.duplicated().to_numpy()
        findings.add_rows((int(row), *words) for row in table.rows[twice])
    row_of = {label: row for row, label in enumerate(labels)}
    rows = [row_of.get(gear, -1) for gear in case.specimen_labels]
    stated = {size: np.append(column, np.nan)[rows] for size, column in sizes.items()}
    missing = Finding(name, "has no row in the table of sizes", "Add its sizes")
    unsized = {gear: missing for gear in case.specimen_labels if gear not in row_of}
    return np.broadcast_to(_ratio(stated, case.gear), len(rows)), unsized


def _columns(
    table: ReadTable, case: Case, findings: FileFindings
) -> tuple[dict[str, int], int]:
    """Return the places of the columns of sizes, and of the one that names the gear."""
    for header in table.headers:
        if header not in SIZES and any(word in header.lower() for word in _SIZE_WORDS):
            words = "a size is not read under this name"
            findings.add(words, f"Name it one of {', '.join(SIZES)}", None, header)
    places = {h: place for place, h in enumerate(table.headers) if h in SIZES}
    if not places or len({*table.headers}) < len(table.headers):
        words = "it has no column of sizes, or two of one name"
        findings.refuse(words, f"Name its columns {', '.join(SIZES)}")
    known = case.columns.get("specimen")
    named = [
        place
        for place, h in enumerate(table.headers)
        if h == known or parse_header(h).quantity == "specimen"
    ]
    if len(named) != 1:
        words = "no column, or more than one, names the gear of a row"
        findings.refuse(words, f"Name one column {known or 'specimen'}")
    return places, named[0]


def _numbers(
    table: ReadTable, header: str, place: int, findings: FileFindings
) -> np.ndarray:
    """Return a size of each row [mm], NaN where it is wrong."""
    cells = table.grid.read(place)
    column, bad = read_numbers(cells, has_comma([cells]))
    for index, words, _ in bad:
        findings.add(words, "State the size", int(table.rows[index]), header)
    for index in np.flatnonzero(np.isfinite(column)):
        for wrong in implausible(header, column[index], "size"):
            row = int(table.rows[index])
            findings.add(wrong.problem, wrong.remedy, row, header)
    return column


def _at_odds(
    table: ReadTable, sizes: Mapping[str, np.ndarray], gear: Gear
) -> Iterator[tuple[int, str, str]]:
    """Yield rows with sizes that contradict each other or the gear file's."""
    names = [name.removesuffix("_mm") for name in SIZES]
    others = {name: float(getattr(gear.geometry, name)) for name in names}
    # Without a height of its own the load acts at the end.
    if "length" in sizes and others["load_height"] == others["length"]:
        del others["load_height"]
    for index, row in enumerate(table.rows):
        stated = {name: float(column[index]) for name, column in sizes.items()}
        for name, words, remedy in size_faults(others | stated):
            yield int(row), f"{name}_mm: {words}", remedy


def _ratio(stated: dict[str, np.ndarray], gear: Gear) -> np.ndarray:
    """Return the stiffness of sizes [mm] over that of the sizes of a gear."""
    known = stated.keys() | gear.source.get("gear", {}).keys()
    if "length" in stated and not known & {"load_height", "load_height_mm"}:
        stated = stated | {"load_height": stated["length"]}
    stiffness = THEORIES[gear.theory]
    sized = np.asarray(stiffness(replace(gear.geometry, **stated), 1.0))
    return sized / np.asarray(stiffness(gear.geometry, 1.0))
