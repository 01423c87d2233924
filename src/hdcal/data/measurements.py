"""From a CSV file to checked columns, runs and gears."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.bad_gears import among, bad_gears, offer
from hdcal.data.cells import read_cells
from hdcal.data.columns import (
    LABELS,
    QUANTITIES,
    REQUIRED,
    Column,
    Columns,
    match_columns,
)
from hdcal.data.csv_table import CsvTable, split_table
from hdcal.data.findings import FileFindings
from hdcal.data.frames import NAME, frame_text, is_frame
from hdcal.data.mountings import run_labels
from hdcal.data.text_file import read_text
from hdcal.data.units import column_to_code
from hdcal.data.value_checks import FEWEST_ROWS, check_time, check_values
from hdcal.errors import Finding, InputError, quoted

# How a note begins that says what was guessed.
ASSUMED = "ASSUMED: "
# Labels that one finding names.
_LISTED = 20


@dataclass(frozen=True)
class Labels:
    """Which of several mountings or gears each row was taken on.

    Attributes:
        index: shape (n,).
        names: by index, in order of appearance.
    """

    index: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True)
class Measurements:
    """What was measured, in code units, in the order it was taken.

    Attributes:
        columns: in which nothing is wrong.
        run: the mountings.
        specimen: the gears.
        left_out: gears that are not among them, each with what is wrong with it.
    """

    columns: Columns
    run: Labels
    specimen: Labels
    left_out: dict[str, Finding] = field(default_factory=dict)

    @property
    def mounted(self) -> bool:
        """Tell whether it was guessed that gears were mounted several times."""
        guessed = "run" not in self.columns.values
        return guessed and len(self.run.names) > len(self.specimen.names)


def read_measurements(
    path: Any,
    mapping: Mapping[str, str] | None = None,
    encoding: str | None = None,
    sheet: str | None = None,
    *,
    check: Callable[[Columns, Labels], None] | None = None,
    skip_bad: bool | None = None,
) -> Measurements:
    """Read a file of measurements.

    Args:
        path: the file, or a table in memory (see `frame_text`).
        mapping: quantity -> header, the unit in brackets, as in
            `{"force": "Load[kgf]"}`; for headers that do not name themselves.
        encoding: of the text; by default what it looks like.
        sheet: of a workbook; by default the one with readings.
        check: finds what else is wrong with rows, each of a gear.
        skip_bad: leave out gears of which a row is wrong, whole; False: refuse them,
            and say that this can be asked for.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    left_out: dict[str, Finding] = {}
    with FileFindings(NAME if is_frame(path) else str(path)) as findings:
        found = _find_columns(path, mapping, findings, encoding=encoding, sheet=sheet)
        while True:
            measured = _measured(found)
            columns, gears = measured.columns, measured.specimen
            if check is not None:
                check(columns, gears)
            wrong, rows = columns.findings, columns.table.rows
            bad = bad_gears(wrong, rows, gears.index, gears.names)
            if not skip_bad or not bad or len(bad) == len(gears.names):
                break
            # As if they had never been in the file: what is guessed of cells, such as
            # their decimal sign, is guessed of all of them.
            left_out |= bad
            kept = ~among(gears.names, bad)[gears.index]
            found = replace(found, table=found.table.take(kept))
        findings += wrong
        if skip_bad is False and 0 < len(bad) < len(gears.names):
            findings.append(offer(bad, len(gears.names)))
    return replace(measured, left_out=left_out)


def _measured(found: Columns) -> Measurements:
    """Return what stands in columns, right or wrong: their findings say."""
    columns = _with_values(found, FEWEST_ROWS)
    rows = len(columns.table.rows)
    specimen = labels_of(columns.values.get("specimen"), rows)
    run = runs_of(run_labels(columns.values, specimen.index), specimen, rows)
    check_time(columns, run.index)
    return Measurements(columns, run, specimen)


def of_specimen(measured: Measurements, label: str) -> Measurements:
    """Return what was measured on one of several specimens.

    Raises:
        InputError: none is called so, or it has too few rows, or was not moved.
    """
    findings, names = measured.columns.findings, measured.specimen.names
    if label not in names:
        listed = ", ".join(map(quoted, names[:_LISTED]))
        listed += f" and {len(names) - _LISTED} more" * (len(names) > _LISTED)
        words = f"no specimen is called {quoted(label)}"
        if len(names) == 1:
            findings.refuse(words, "Say `columns` 'specimen=HEADER', which tells them")
        findings.refuse(words, f"There are {listed}")
    here = measured.specimen.index == names.index(label)
    if np.sum(here) < FEWEST_ROWS:
        words = f"specimen {quoted(label)} has {np.sum(here)} rows"
        findings.refuse(words, f"Take one with {FEWEST_ROWS} or more")
    columns = replace(
        measured.columns,
        values={name: v[here] for name, v in measured.columns.values.items()},
        table=replace(measured.columns.table, rows=measured.columns.table.rows[here]),
    )
    check_values(columns, 0)
    if findings:
        raise InputError(findings)
    index, kept = pd.factorize(measured.run.index[here])
    return Measurements(
        columns,
        Labels(index, tuple(measured.run.names[run] for run in kept)),
        Labels(np.zeros(len(index), int), (label,)),
    )


def read_columns(
    path: Any,
    mapping: Mapping[str, str] | None,
    findings: FileFindings,
    *,
    quantities: Sequence[str] = QUANTITIES,
    required: Sequence[str] = REQUIRED,
    fewest: int = FEWEST_ROWS,
    encoding: str | None = None,
    sheet: str | None = None,
) -> Columns:
    """Read the columns of a CSV file that hold known quantities, right or wrong.

    Args:
        path: the file, or a table in memory.
        mapping: quantity -> header with its unit in brackets, or None.
        findings: of the file; gets one for everything that is wrong.
        quantities: what to look for.
        required: which of them must be there.
        fewest: rows that are needed.
        encoding: of the text; by default what it looks like.
        sheet: of a workbook; by default the one with readings.

    Raises:
        InputError: no table can be found in the file.
    """
    found = _find_columns(
        path,
        mapping,
        findings,
        quantities=quantities,
        required=required,
        encoding=encoding,
        sheet=sheet,
    )
    columns = _with_values(found, fewest)
    findings += columns.findings
    return replace(columns, findings=findings)


def _find_columns(
    path: Any,
    mapping: Mapping[str, str] | None,
    findings: FileFindings,
    *,
    quantities: Sequence[str] = QUANTITIES,
    required: Sequence[str] = REQUIRED,
    encoding: str | None = None,
    sheet: str | None = None,
) -> Columns:
    """Return where the columns stand, without their values, as `read_columns` does."""
    if is_frame(path):
        utf8, sha256, guessed = frame_text(path, findings)
    else:
        utf8, sha256, guessed = read_text(Path(path), findings, encoding, sheet)
    mapping = mapping or {}
    numbered = any(wanted[:1].isdigit() for wanted in mapping.values())
    named = {"numbered": numbered, "labelled": "run" in mapping}
    table = split_table(utf8, findings, **named)
    used = match_columns(table, mapping, quantities, required, findings)
    notes = tuple(_assumed(guessed, table, used))
    return Columns({}, used, table, sha256, findings, notes)


def _with_values(found: Columns, fewest: int) -> Columns:
    """Return columns with what stands in them, and findings of that alone."""
    findings = FileFindings(found.findings.file)
    findings.places = found.findings.places
    values, told = read_cells(found.table, found.used, findings)
    for quantity, column in found.used.items():
        if quantity not in LABELS:
            # a wild number may overflow here; the limits below report it
            with np.errstate(over="ignore"):
                converted = column_to_code(values[quantity], quantity, column.unit)
            values[quantity] = converted
    notes = (*found.notes, *(f"{ASSUMED}{note}" for note in told))
    columns = replace(found, values=values, findings=findings, notes=notes)
    check_values(columns, fewest)
    return columns


def _assumed(
    guessed: str, table: CsvTable, used: Mapping[str, Column]
) -> Iterator[str]:
    """Yield what was guessed of a file, each with how to say otherwise."""
    for note in (*([guessed] if guessed else []), *table.notes):
        yield f"{ASSUMED}{note}"
    for column in used.values():
        if column.against:
            yield (
                f"{ASSUMED}{quoted(column.header)} is in {column.unit}, as was said, "
                f"though it names {column.against}"
            )
    guesses = [column for column in used.values() if column.guessed]
    if guesses:
        said = ", ".join(
            f"{quoted(c.header)} is the {c.quantity}{f' in {c.unit}' * bool(c.unit)}"
            for c in guesses
        )
        one = guesses[0].quantity
        form = "HEADER" if one in LABELS else "HEADER[UNIT]"
        yield f"{ASSUMED}{said}. If not, name the column: --column '{one}={form}'"


def labels_of(labels: np.ndarray | None, rows: int) -> Labels:
    """Return which gear each row is of; one where no labels, shape (n,), tell."""
    if labels is None:
        return Labels(np.zeros(rows, int), ("1",))
    index, names = pd.factorize(labels)
    return Labels(index, tuple(names))


def runs_of(labels: np.ndarray | None, specimen: Labels, rows: int) -> Labels:
    """Runs by label; the same label on two specimens is two mountings."""
    if labels is None:
        return specimen if specimen.index.any() else labels_of(None, rows)
    run, gears = labels_of(labels, rows), len(specimen.names)
    index, pairs = pd.factorize(run.index * gears + specimen.index)
    if len(pairs) == len(run.names):
        return run
    both = (divmod(int(pair), gears) for pair in pairs)
    names = (f"{specimen.names[gear]}/{run.names[one]}" for one, gear in both)
    return Labels(index, tuple(names))
