"""Parquet, a file or a folder of them: read in batches, whatever the number of rows."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from hdcal.data.bad_gears import bad_gears, offer
from hdcal.data.case import Case, Gear
from hdcal.data.case_of import case_of
from hdcal.data.findings import FileFindings
from hdcal.data.measurements import Measurements, read_measurements
from hdcal.data.reading import GEAR_NAME, gear_of
from hdcal.data.tables.arrow_grid import arrow_grid
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.headers import GROUPINGS, LABELS, parse_header
from hdcal.data.tables.named_columns import Column
from hdcal.data.tables.parquet_files import parquet_files, parquet_table
from hdcal.data.tables.values import read_labels, read_values
from hdcal.data.too_far import beyond_radius, too_far
from hdcal.data.value_checks import wild_rows
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    from pyarrow.dataset import Dataset

# Rows that are looked at one by one.
_SHOWN = 50_000
_REMEDY = "Save it anew"
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
    beside = (path if root else path.parent) / GEAR_NAME
    gear = beside if gear is None and beside.exists() else gear
    with FileFindings(str(path)) as findings:
        dataset = parquet_table(files, root, findings)
        found, notes = gear_of(gear, None, False, (theory, None, reading))
        named = dict(found.source.get("columns", {})) | dict(columns or {})
        frame = _first_rows(dataset, findings)

        def read(rows: pd.DataFrame) -> Measurements:
            check = partial(too_far, gear=found)
            return read_measurements(rows, named, check=check, skip_bad=skip_bad)

        try:
            measured = _placed(dataset, frame, read)
        except InputError:
            others = _rows_of_others(dataset, frame, named)
            if not skip_bad or others.empty:
                raise
            measured = _placed(dataset, pd.concat([frame, others]), read)
        used = measured.columns.used
        if "specimen" not in used:
            remedy = "Say `columns` specimen=HEADER, which names the gear of a row"
            findings.refuse("no column says which gear a row is of", remedy)
    # Lots, operators, rigs and dates come from all rows later.
    columns_of_case = measured.columns.values.items()
    values = {name: v for name, v in columns_of_case if name not in GROUPINGS}
    if measured.mounted:
        values["run"] = np.array(measured.run.names, object)[measured.run.index]
    measured = replace(measured, columns=replace(measured.columns, values=values))
    name = path.resolve().name if root else path.stem
    case = replace(case_of(measured, found, notes, name), left_out=measured.left_out)
    used = {quantity: used[quantity] for quantity in _USED if quantity in used}
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
            table = ReadTable(tuple(headers), row, grid, size)
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
    bad = bad_gears(findings, rows, gear, gears)
    wrong = np.isin(rows, [*findings.rows])
    # Rows of a gear that is not named are nobody's, and stop all.
    if skip_bad and not np.any(wrong & (gears[gear] == "")):
        findings.clear()
    elif skip_bad is False and bad:
        findings.append(offer(bad))
    return Batch(values, labels, bad).where(~wrong)


def _first_rows(dataset: "Dataset", findings: FileFindings) -> pd.DataFrame:
    """Return the first rows of all files, without columns that hold no plain cells."""
    from pyarrow import types

    plain = [f.name for f in dataset.schema if not types.is_nested(f.type)]
    try:
        return dataset.head(_SHOWN, columns=plain).to_pandas()
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(f"is no Parquet that can be read ({error})", _REMEDY)


def _rows_of_others(
    dataset: "Dataset", frame: pd.DataFrame, columns: Mapping[str, str]
) -> pd.DataFrame:
    """Return the first rows of other gears where all of a frame are of one.

    Args:
        dataset: of which the frame is the first rows.
        frame: indexed by their places there.
        columns: quantity -> header, as the user or the gear file names them.
    """
    headers = [str(name) for name in frame]
    labels = [name for name in headers if name == columns.get("specimen")]
    labels = labels or [h for h in headers if parse_header(h).quantity == "specimen"]
    gears = frame[labels[0]].unique() if len(labels) == 1 else ()
    if len(gears) != 1:
        return frame.iloc[:0]
    found, at = [frame.iloc[:0]], 0
    for batch in dataset.to_batches(columns=[*frame]):
        rows = batch.to_pandas()
        rows.index += at
        at += len(rows)
        found.append(rows[rows[labels[0]] != gears[0]])
        if sum(map(len, found)) >= _SHOWN:
            break
    return pd.concat(found).iloc[:_SHOWN]


def _placed(
    dataset: "Dataset",
    frame: pd.DataFrame,
    read: Callable[[pd.DataFrame], Measurements],
) -> Measurements:
    """Return what is read of the first rows; findings name file and row.

    Args:
        dataset: the files.
        frame: some of their rows, indexed by their places there.
        read: reads it.

    Raises:
        InputError: holds what is wrong.
    """
    ends = np.cumsum([one.count_rows() for one in dataset.get_fragments()])
    names = [str(one.path) for one in dataset.get_fragments()]

    def located(wrong: Finding) -> Finding:
        if wrong.row is None:
            return wrong
        # Below a line of headers.
        at = frame.index[wrong.row - 2]
        place = int(np.searchsorted(ends, at, side="right"))
        row = at + 1 - (int(ends[place - 1]) if place else 0)
        return replace(wrong, file=names[place], row=row)

    try:
        measured = read(frame)
    except InputError as error:
        raise InputError(map(located, error.findings)) from None
    left_out = {gear: located(wrong) for gear, wrong in measured.left_out.items()}
    return replace(measured, left_out=left_out)


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
