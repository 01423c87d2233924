"""Parquet, a file or a folder of them: read in batches, whatever the number of rows."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from hdcal.data.bad_gears import bad_gears, offer
from hdcal.data.case import Case, Gear
from hdcal.data.findings import FileFindings
from hdcal.data.measurements import read_measurements
from hdcal.data.parquet_head import (
    first_rows,
    placed,
    quantity_of,
    rows_of_others,
    runs_told,
)
from hdcal.data.reading import GEAR_NAME, read_case
from hdcal.data.tables.arrow_grid import arrow_grid
from hdcal.data.tables.blocks import Table
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.tables.columns import Column
from hdcal.data.tables.headers import GROUPINGS, LABELS
from hdcal.data.tables.parquet_files import parquet_files, parquet_table
from hdcal.data.tables.values import read_labels, read_values
from hdcal.data.too_far import beyond_radius
from hdcal.data.value_checks import wild_rows
from hdcal.errors import Finding, InputError

# Rows of a batch.
_BATCH = 1 << 18
_USED = ("deformation", "force", "temperature", "specimen", "run", *GROUPINGS)


class Batch(NamedTuple):
    """Some rows, without those that are wrong.

    Attributes:
        values: deformation [mm], force [N] and temperature [°C], as far as they are
            read; shape (n,).
        labels: of specimen, run, lot, operator, rig and date, likewise: the index of
            each row's, and the labels.
        bad: gears of which a row is wrong, each with what that is.
    """

    values: dict[str, np.ndarray]
    labels: dict[str, tuple[np.ndarray, np.ndarray]]
    bad: dict[str, Finding]

    def where(self, kept: np.ndarray) -> "Batch":
        """Return the rows that are true in a mask, shape (n,)."""
        values = {name: column[kept] for name, column in self.values.items()}
        labels = {name: (at[kept], texts) for name, (at, texts) in self.labels.items()}
        return Batch(values, labels, self.bad)


@dataclass(frozen=True)
class Parquet:
    """Files that are read in batches.

    Attributes:
        name: of the file, or of the folder.
        case: of the first rows, which says what the columns are.
        sha256: of the bytes of the file, or of the hashes of all in the folder.
        files: in their order.
        root: of their folder; empty where there is one file.
        used: columns by quantity.
    """

    name: str
    case: Case
    sha256: str
    files: Sequence[str]
    root: str
    used: Mapping[str, Column]


def read_parquet(
    data: Path | str,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    theory: str | None = None,
    reading: str | None = None,
    skip_bad: bool | None = None,
) -> Parquet:
    """Look into a Parquet file, or a folder of them, partitioned or not.

    Args:
        data: the file, or the folder.
        gear: as in `read_case`; by default the gear.toml beside the file, or in the
            folder.
        columns: as in `read_case`.
        theory: likewise.
        reading: likewise.
        skip_bad: likewise.

    Raises:
        InputError: holds everything that is wrong with its first rows, or with the
            kinds of its columns.
    """
    path = Path(data)
    files = parquet_files(path)
    root = str(path) if path.is_dir() else ""
    with FileFindings(str(path)) as findings:
        dataset = parquet_table(files, root, findings)
        beside = (path if root else path.parent) / GEAR_NAME
        gear = beside if gear is None and beside.exists() else gear
        how: dict = {"columns": columns, "theory": theory, "reading": reading}
        how |= {"skip_bad": skip_bad}
        frame = first_rows(dataset, findings)
        # Lots, operators, rigs and dates are told of all rows.
        further = [
            name for name in frame if quantity_of(str(name), columns) in GROUPINGS
        ]

        def read(rows: pd.DataFrame) -> Case:
            runs = runs_told(rows, gear, columns, (theory, None, reading))
            return read_case(rows.drop(columns=further).assign(**runs), gear, **how)

        try:
            case = placed(dataset, frame, read)
        except InputError:
            if not skip_bad:
                raise
            others = rows_of_others(dataset, frame, columns)
            if others.empty:
                raise
            frame = pd.concat([frame, others])
            case = placed(dataset, frame, read)
        used = _columns(frame, case, columns, findings)
    name = path.resolve().name if root else path.stem
    return Parquet(name, case, _sha256(files), files, root, used)


def read_batches(
    file: str,
    root: str,
    used: Mapping[str, Column],
    gear: Gear,
    *,
    skip_bad: bool | None = None,
) -> Iterator[Batch]:
    """Yield the rows of one file, in their order.

    Args:
        file: one of those of a `Parquet`.
        root: likewise.
        used: likewise.
        gear: what is known of all gears.
        skip_bad: as in `read_case`.

    Raises:
        InputError: holds what is wrong with the first batch that is.
    """
    with FileFindings(file) as findings:
        dataset = parquet_table([file], root, findings)
    row, headers = 1, [column.header for column in used.values()]
    placed = {
        quantity: replace(column, position=place)
        for place, (quantity, column) in enumerate(used.items())
    }
    numeric = {q: column for q, column in placed.items() if q not in LABELS}
    for batch in dataset.to_batches(columns=headers, batch_size=_BATCH):
        with FileFindings(file) as findings:
            size = batch.num_rows
            grid = arrow_grid(batch.schema, batch.column, size, row, days=True)
            table = Table(tuple(headers), row, grid, size)
            values, _ = read_values(table, numeric, findings)
            labels = {
                quantity: read_labels(table, column, findings, [])
                for quantity, column in placed.items()
                if quantity in LABELS
            }
            for quantity, column in numeric.items():
                wild = wild_rows(values[quantity], quantity, table.rows)
                findings.add_rows(wild, column.header)
            rows = table.rows
            fine = ~np.isin(rows, [*findings.rows])
            read, of = values["deformation"][fine], labels["specimen"][0][fine]
            beyond = beyond_radius(read, of, rows[fine], gear)
            findings.add_rows(beyond, used["deformation"].header)
            found = _batch(values, labels, rows, findings, skip_bad=skip_bad)
        row += size
        if size:
            yield found


def _batch(
    values, labels, rows: np.ndarray, findings: FileFindings, *, skip_bad: bool | None
) -> Batch:
    """Return what was read; where bad gears may be left out, they are no findings."""
    gear, gears = labels["specimen"]
    # Rows of a gear that is not named are nobody's.
    names = ["" if name == NOT_STATED else name for name in gears]
    bad = bad_gears(findings, rows, gear, names)
    wrong = np.isin(rows, [*findings.rows])
    if skip_bad and not np.any(wrong & (gears[gear] == NOT_STATED)):
        findings.clear()
    elif skip_bad is False and bad:
        findings.append(offer(bad))
    return Batch(values, labels, bad).where(~wrong)


def _columns(frame, case: Case, columns, findings: FileFindings) -> dict[str, Column]:
    """Return the columns that are used, by quantity."""
    named = dict(case.gear.source.get("columns", {})) | dict(columns or {})
    # What is wrong with rows was told, or is left out.
    used = read_measurements(frame, named, skip_bad=True).columns.used
    if "specimen" not in used:
        remedy = "Say `columns` specimen=HEADER, which names the gear of a row"
        findings.refuse("no column says which gear a row is of", remedy)
    return {quantity: used[quantity] for quantity in _USED if quantity in used}


def _sha256(files: Sequence[str]) -> str:
    """Return the hash of a file, or of the hashes of several."""
    each = []
    for name in files:
        with open(name, "rb") as file:
            each.append(hashlib.file_digest(file, "sha256").hexdigest())
    return (
        each[0]
        if len(each) == 1
        else hashlib.sha256("".join(each).encode()).hexdigest()
    )
