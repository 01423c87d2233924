"""Parquet, a file or a folder of them: read in batches, whatever the number of rows."""

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from hdcal.data.bad_gears import among, bad_gears, offer
from hdcal.data.case import Case, Gear
from hdcal.data.cells import NOT_STATED
from hdcal.data.columns import LABELS, Column
from hdcal.data.findings import FileFindings
from hdcal.data.header_words import GROUPINGS, guess_header
from hdcal.data.measurements import read_measurements
from hdcal.data.parquet_cells import label_cells, number_cells
from hdcal.data.parquet_table import parquet_files, parquet_table
from hdcal.data.reading import GEAR_NAME, read_case
from hdcal.data.too_far import beyond_radius
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    from pyarrow.dataset import Dataset

# Rows that are looked at one by one, and of a batch.
_SHOWN, _BATCH = 50_000, 1 << 18
_USED = ("deformation", "force", "temperature", "specimen", "run", *GROUPINGS)
_REMEDY = "Save it anew"


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
        frame = _head(dataset, findings)
        # Lots, operators, rigs and dates are told of all rows.
        further = [name for name in frame if _quantity(str(name), columns) in GROUPINGS]

        def read(rows: pd.DataFrame) -> Case:
            return read_case(rows.drop(columns=further), gear, **how)

        try:
            case = _placed(dataset, frame, read)
        except InputError:
            others = _others(dataset, frame, columns) if skip_bad else frame.iloc[:0]
            if others.empty:
                raise
            frame = pd.concat([frame, others])
            case = _placed(dataset, frame, read)
        case, used = _with_runs(frame, case, columns, findings)
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
    for batch in dataset.to_batches(columns=headers, batch_size=_BATCH):
        values, labels = {}, {}
        with FileFindings(file) as findings:
            for quantity, column in used.items():
                if quantity in LABELS:
                    labels[quantity] = label_cells(batch, column, row, findings)
                else:
                    values[quantity] = number_cells(batch, column, row, findings)
            rows = np.arange(row, row + batch.num_rows)
            fine = ~np.isin(rows, [*findings.rows])
            read, of = values["deformation"][fine], labels["specimen"][0][fine]
            beyond = beyond_radius(read, of, rows[fine], gear)
            findings.add_rows(beyond, used["deformation"].header)
            found = _batch(values, labels, rows, findings, skip_bad=skip_bad)
        row += batch.num_rows
        if batch.num_rows:
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


def _head(dataset: "Dataset", findings: FileFindings) -> pd.DataFrame:
    """Return the first rows of all files, without columns that hold no plain cells."""
    from pyarrow import types

    plain = [f.name for f in dataset.schema if not types.is_nested(f.type)]
    try:
        return dataset.head(_SHOWN, columns=plain).to_pandas()
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(f"is no Parquet that can be read ({error})", _REMEDY)


def _others(
    dataset: "Dataset", frame: pd.DataFrame, columns: Mapping[str, str] | None
) -> pd.DataFrame:
    """Return the first rows of other gears where all of a frame are of one.

    Args:
        dataset: of which the frame is the first rows.
        frame: indexed by their places there.
        columns: as in `read_case`.
    """
    whose = [name for name in frame if _quantity(str(name), columns) == "specimen"]
    gears = frame[whose[0]].unique() if len(whose) == 1 else ()
    if len(gears) != 1:
        return frame.iloc[:0]
    found, at = [frame.iloc[:0]], 0
    for batch in dataset.to_batches(columns=[*frame]):
        rows = batch.to_pandas()
        rows.index += at
        at += len(rows)
        found.append(rows[rows[whose[0]] != gears[0]])
        if sum(map(len, found)) >= _SHOWN:
            break
    return pd.concat(found).iloc[:_SHOWN]


def _placed(
    dataset: "Dataset", frame: pd.DataFrame, read: Callable[[pd.DataFrame], Case]
) -> Case:
    """Return what is read of the first rows; what is wrong is told by file and row.

    Args:
        dataset: the files.
        frame: some of their rows, indexed by their places there.
        read: reads it.

    Raises:
        InputError: holds what is wrong.
    """
    ends = np.cumsum([one.count_rows() for one in dataset.get_fragments()])
    names = [str(one.path) for one in dataset.get_fragments()]

    def placed(wrong: Finding) -> Finding:
        if wrong.row is None:
            return wrong
        # Below a line of headers.
        at = frame.index[wrong.row - 2]
        place = int(np.searchsorted(ends, at, side="right"))
        row = at + 1 - (int(ends[place - 1]) if place else 0)
        return replace(wrong, file=names[place], row=row)

    try:
        case = read(frame)
    except InputError as error:
        raise InputError(map(placed, error.findings)) from None
    left_out = {gear: placed(wrong) for gear, wrong in case.left_out.items()}
    return replace(case, left_out=left_out)


def _quantity(header: str, columns: Mapping[str, str] | None) -> str:
    """Return which quantity a header is taken for, or said to be."""
    said = {name: quantity for quantity, name in (columns or {}).items()}
    guess = guess_header(header)
    return said.get(header, guess.quantity if guess is not None else "")


def _with_runs(
    frame, case: Case, columns, findings: FileFindings
) -> tuple[Case, dict[str, Column]]:
    """Return a case with its runs as all columns tell them, and which of them are used.

    Args:
        frame: the rows that the case was read from.
        case: in which lots, operators, rigs and dates are not told.
        columns: as in `read_case`.
        findings: of the files.
    """
    named = dict(case.gear.source.get("columns", {})) | dict(columns or {})
    # What is wrong with rows was told, or is left out.
    measured = read_measurements(frame, named, skip_bad=True)
    used, gears = measured.columns.used, measured.specimen
    if "specimen" not in used:
        remedy = "Say `columns` specimen=HEADER, which names the gear of a row"
        findings.refuse("no column says which gear a row is of", remedy)
    kept = ~among(gears.names, case.left_out)[gears.index]
    records = replace(case.records, run=pd.factorize(measured.run.index[kept])[0])
    found = {quantity: used[quantity] for quantity in _USED if quantity in used}
    return replace(case, records=records), found


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
