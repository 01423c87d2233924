"""Parquet, a file or a folder of them: read in batches, whatever the number of rows."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from hdcal.data.array_files import PARQUET
from hdcal.data.case import Case
from hdcal.data.cells import NOT_STATED
from hdcal.data.columns import LABELS, Column
from hdcal.data.findings import FileFindings
from hdcal.data.header_words import GROUPINGS
from hdcal.data.measurements import read_measurements
from hdcal.data.plausible import RANGES
from hdcal.data.reading import GEAR_NAME, read_case
from hdcal.data.units import column_to_code
from hdcal.errors import quoted

if TYPE_CHECKING:
    from pyarrow import RecordBatch
    from pyarrow.dataset import Dataset

# Rows that are looked at one by one, and of a batch.
_SHOWN, _BATCH = 50_000, 1 << 18
_USED = ("deformation", "force", "temperature", "specimen", "run", *GROUPINGS)
_REMEDY = "Save it anew"


class Batch(NamedTuple):
    """Some rows.

    Attributes:
        values: deformation [mm], force [N] and temperature [°C], as far as they are
            read; shape (n,).
        labels: of specimen, run, lot, operator and date, likewise: the index of each
            row's, and the labels.
    """

    values: dict[str, np.ndarray]
    labels: dict[str, tuple[np.ndarray, np.ndarray]]


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


def is_parquet(data: Any) -> bool:
    """Tell whether data are a Parquet file, or a folder that holds such ones."""
    if not isinstance(data, str | Path):
        return False
    path = Path(data)
    if path.is_dir():
        return next(path.rglob("*.parquet"), None) is not None
    try:
        with path.open("rb") as file:
            return file.read(len(PARQUET)) == PARQUET
    except OSError:
        return False


def read_parquet(
    data: Path | str,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    theory: str | None = None,
    reading: str | None = None,
) -> Parquet:
    """Look into a Parquet file, or a folder of them, partitioned or not.

    Args:
        data: the file, or the folder.
        gear: as in `read_case`; by default the gear.toml beside the file, or in the
            folder.
        columns: as in `read_case`.
        theory: likewise.
        reading: likewise.

    Raises:
        InputError: holds everything that is wrong with its first rows, or with the
            kinds of its columns.
    """
    path = Path(data)
    files = sorted(map(str, path.rglob("*.parquet"))) if path.is_dir() else [str(path)]
    root = str(path) if path.is_dir() else ""
    with FileFindings(str(path)) as findings:
        dataset = _dataset(files, root, findings)
        beside = (path if root else path.parent) / GEAR_NAME
        gear = beside if gear is None and beside.exists() else gear
        frame = dataset.head(_SHOWN).to_pandas()
        case = read_case(frame, gear, columns=columns, theory=theory, reading=reading)
        used = _columns(frame, case, columns, findings)
    name = path.resolve().name if root else path.stem
    return Parquet(name, case, _sha256(files), files, root, used)


def read_batches(file: str, root: str, used: Mapping[str, Column]) -> Iterator[Batch]:
    """Yield the rows of one file, in their order.

    Args:
        file: one of those of a `Parquet`.
        root: likewise.
        used: likewise.

    Raises:
        InputError: holds what is wrong with the first batch that is.
    """
    with FileFindings(file) as findings:
        dataset = _dataset([file], root, findings)
    row, headers = 1, [column.header for column in used.values()]
    for batch in dataset.to_batches(columns=headers, batch_size=_BATCH):
        values, labels = {}, {}
        with FileFindings(file) as findings:
            for quantity, column in used.items():
                if quantity in LABELS:
                    labels[quantity] = _labels(batch, column, row, findings)
                else:
                    values[quantity] = _numbers(batch, column, row, findings)
        row += batch.num_rows
        if batch.num_rows:
            yield Batch(values, labels)


def _dataset(files: Sequence[str], root: str, findings: FileFindings) -> "Dataset":
    """Return files as one table; each column is of one kind in all of them."""
    try:
        from pyarrow import dataset as tables
    except ImportError:
        words = "is Parquet, which needs pyarrow"
        findings.refuse(words, 'pip install "hdcal[files]"')
    split = {"partitioning": "hive", "partition_base_dir": root} if root else {}
    try:
        found = tables.dataset([*files], format="parquet", **split)
        first, *others = found.get_fragments()
        for one in others:
            for field in first.physical_schema:
                kind = one.physical_schema.field(field.name).type
                if kind != field.type:
                    words = f"{quoted(field.name)} is {kind} in {one.path}"
                    findings.add(f"{words}, and {field.type} in others", _REMEDY)
    except KeyError as error:
        findings.refuse(f"one of its files has no column {error}", _REMEDY)
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(f"is no Parquet that can be read ({error})", _REMEDY)
    return found


def _numbers(
    batch: "RecordBatch", column: Column, row: int, findings: FileFindings
) -> np.ndarray:
    """Return a column in code units."""
    cells = batch.column(column.header)
    try:
        read = cells.to_numpy(zero_copy_only=False).astype(float)
    except (TypeError, ValueError):
        words = f"{quoted(column.header)} is {cells.type}, no numbers"
        findings.refuse(words, "Save it as numbers")
    values, known = (
        column_to_code(read, column.quantity, column.unit),
        RANGES[column.quantity],
    )
    wrong = np.flatnonzero(~((values >= known.low) & (values <= known.high)))
    words = known.problem()
    each = (
        (
            row + int(place),
            "the cell is empty" if np.isnan(values[place]) else words,
            "Check the number and its unit",
        )
        for place in wrong
    )
    findings.add_rows(each, column.header, "cells like these")
    return values


def _labels(
    batch: "RecordBatch", column: Column, row: int, findings: FileFindings
) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of each row's label, and the labels."""
    cells = batch.column(column.header).to_pandas()
    if pd.api.types.is_datetime64_any_dtype(cells):
        # A day is told, not when each reading was taken.
        cells = cells.dt.floor("D")
    place, found = pd.factorize(cells)
    texts = np.array([*map(_text, found), NOT_STATED], object)
    empty = place < 0
    if column.quantity not in GROUPINGS:
        words, remedy = f"the {column.quantity} label is empty", "Name it"
        each = ((row + int(at), words, remedy) for at in np.flatnonzero(empty))
        findings.add_rows(each, column.header, "empty labels")
    return np.where(empty, len(found), place), texts


def _text(label: Any) -> str:
    return " ".join(str(label).split()) or NOT_STATED


def _columns(frame, case: Case, columns, findings: FileFindings) -> dict[str, Column]:
    """Return the columns that are used, by quantity."""
    named = dict(case.gear.source.get("columns", {})) | dict(columns or {})
    used = read_measurements(frame, named).columns.used
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
