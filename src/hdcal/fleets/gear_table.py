"""Gears of several sizes: a table beside the readings that states those of each one."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.findings import FileFindings
from hdcal.data.gear_file.schema import size_faults
from hdcal.data.measurements.bad_gears import among, bad_gears
from hdcal.data.plausible import implausible
from hdcal.data.records import Geometry
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.cells import has_comma, read_numbers
from hdcal.data.tables.headers import parse_header
from hdcal.data.tables.sources import is_frame, read_source
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, InputError, quoted
from hdcal.physics.theory import THEORIES

# Sizes that a table may state, as a gear file calls them.
SIZES = ("wall_thickness_mm", "radius_mm", "length_mm", "load_height_mm")
NAME = "the table of gears"
_NAMES = {name.removesuffix("_mm") for name in SIZES}
# What a header speaks of that means a size.
_LIKE = ("wall", "radius", "length", "load_height", "diameter", "thickness")
_FIRST_FEW = 3


@dataclass(frozen=True)
class GearSizes:
    """What a table says of the sizes of gears.

    Attributes:
        ratio: stiffness at K = 1 of each gear over that of the gear file's sizes, NaN
            of one whose sizes are missing or cannot be; shape (g,).
        bad: those gears, each with the first thing that is wrong.
        findings: all that is wrong with them.
    """

    ratio: np.ndarray
    bad: Mapping[str, Finding]
    findings: Sequence[Finding]


def gear_sizes(source: Any, case: Case) -> GearSizes:
    """Return the sizes of each gear; one that the table does not have is the file's.

    Args:
        source: a CSV file or a workbook, or a table in memory, with a column that names
            the gear, and columns called as `SIZES`.
        case: the readings, which name their gears.

    Raises:
        InputError: holds what is wrong with the table, beside single gears.
    """
    in_memory = is_frame(source)
    if not in_memory and not isinstance(source, str | Path):
        remedy = "Give a path, a DataFrame, or arrays by header"
        raise InputError([Finding("gears", f"is a {type(source).__name__}", remedy)])
    with FileFindings(NAME if in_memory else str(source)) as findings:
        if case.gear.theory == SPRING:
            words = "its sizes say nothing of the stiffness, as no gear file has sizes"
            findings.refuse(words, "Name one, as `gear` FILE.toml")
        table, _ = read_source(source, findings)
    sizes, labels = _read(table, case, findings)
    bad = bad_gears(findings, table.rows, labels)
    if findings:
        # What is wrong without them is wrong with the table.
        table, again = table.take(~among(labels, bad)), FileFindings(findings.file)
        sizes, labels = _read(table, case, again)
        if again:
            raise InputError(findings)
    missing = _missing(case, {*labels, *bad}, findings)
    place = {label: row for row, label in enumerate(labels)}
    rows = [place.get(gear, -1) for gear in case.specimen_labels]
    own = {name: np.append(column, np.nan)[rows] for name, column in sizes.items()}
    measured = {gear: bad[gear] for gear in case.specimen_labels if gear in bad}
    return GearSizes(_ratio(own, case.gear), measured | missing, findings)


def _read(
    table: ReadTable, case: Case, findings: FileFindings
) -> tuple[dict[str, np.ndarray], list[str]]:
    """Return sizes and gear of each row."""
    sizes = _sizes(table, findings)
    at_odds = _at_odds(table, sizes, case.gear.geometry)
    findings.add_rows(at_odds)
    return sizes, _labels(table, case, findings)


def _ratio(stated: dict[str, np.ndarray], gear: Gear) -> np.ndarray:
    """Return the stiffness of sizes [mm], shape (g,) each, over that of a gear's."""
    if "length" in stated and "load_height" not in stated:
        told = "load_height_mm" in gear.source.get("gear", {})
        stated |= {} if told else {"load_height": stated["length"]}
    stiffness = THEORIES[gear.theory]
    own = np.asarray(stiffness(replace(gear.geometry, **stated), 1.0))
    one = np.asarray(stiffness(gear.geometry, 1.0))
    return np.broadcast_to(own / one, len(next(iter(stated.values())))).copy()


def _sizes(table: ReadTable, findings: FileFindings) -> dict[str, np.ndarray]:
    """Return the sizes of each row [mm], by their names in a geometry."""
    places = {h: place for place, h in enumerate(table.headers) if h in SIZES}
    for header in table.headers:
        if table.headers.count(header) > 1 and header in SIZES:
            findings.add("two columns are called so", "Keep one", None, header)
        elif header not in SIZES and any(word in header.lower() for word in _LIKE):
            words = "a size is not read under this name"
            findings.add(words, f"Call it one of {', '.join(SIZES)}", None, header)
    if not places:
        words = "it states no sizes"
        findings.refuse(words, f"Name its columns {', '.join(SIZES)}")
    found = {}
    for header, place in places.items():
        cells = table.grid.read([place])[place].astype(object)
        column, bad = read_numbers(cells, has_comma([cells]))
        for index, words, _ in bad:
            findings.add(words, "State the size", int(table.rows[index]), header)
        for index in np.flatnonzero(np.isfinite(column)):
            for wrong in implausible(header, column[index], "size"):
                row = int(table.rows[index])
                findings.add(wrong.problem, wrong.remedy, row, header)
        found[header.removesuffix("_mm")] = column
    return found


def _at_odds(
    table: ReadTable, sizes: Mapping[str, np.ndarray], base: Geometry
) -> Iterator[tuple[int, str, str]]:
    """Yield rows whose sizes cannot be beside each other, or those of the gear file."""
    other = {name: float(size) for name, size in vars(base).items() if name in _NAMES}
    # Without a height of its own the load acts at the end.
    if "length" in sizes and other["load_height"] == other["length"]:
        del other["load_height"]
    for index, row in enumerate(table.rows):
        one = other | {name: float(column[index]) for name, column in sizes.items()}
        for name, words, remedy in size_faults(one):
            yield int(row), f"{name}_mm: {words}", remedy


def _labels(table: ReadTable, case: Case, findings: FileFindings) -> list[str]:
    """Return the gear of each row."""
    known = case.columns.get("specimen")
    places = [
        place
        for place, header in enumerate(table.headers)
        if header == known or parse_header(header).quantity == "specimen"
    ]
    if len(places) != 1:
        words = "it does not say which gear a row is of"
        findings.refuse(words, f"Name one column {known or 'specimen'}")
    labels = table.grid.texts(places[0])
    seen: set[str] = set()
    for row, label in zip(table.rows, labels, strict=True):
        if label in seen:
            words = f"gear {quoted(label)} has a row already"
            findings.add(words, "Keep the one that is right", int(row))
        seen.add(label)
    return labels


def _missing(
    case: Case, known: Container[str], findings: FileFindings
) -> dict[str, Finding]:
    """Return gears that have no row, each with words of its own."""
    words, remedy = "has no row", "Add its sizes"
    missing = [label for label in case.specimen_labels if label not in known]
    for label in missing[:_FIRST_FEW]:
        findings.add(f"gear {quoted(label)} {words}", remedy)
    if more := len(missing[_FIRST_FEW:]):
        findings.add(f"and {more} more gears have none", "Add theirs too")
    words = f"{words} in {findings.file}"
    return {label: Finding(findings.file, words, remedy) for label in missing}
