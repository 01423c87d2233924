"""The first rows of a Parquet file, which say what its columns are."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from hdcal.data.case import Case
from hdcal.data.findings import FileFindings
from hdcal.data.measurements import read_measurements
from hdcal.data.reading import gear_of
from hdcal.data.tables.headers import parse_header
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    from pyarrow.dataset import Dataset

# Rows that are looked at one by one.
_SHOWN = 50_000
_REMEDY = "Save it anew"


def first_rows(dataset: "Dataset", findings: FileFindings) -> pd.DataFrame:
    """Return the first rows of all files, without columns that hold no plain cells."""
    from pyarrow import types

    plain = [f.name for f in dataset.schema if not types.is_nested(f.type)]
    try:
        return dataset.head(_SHOWN, columns=plain).to_pandas()
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(f"is no Parquet that can be read ({error})", _REMEDY)


def rows_of_others(
    dataset: "Dataset", frame: pd.DataFrame, columns: Mapping[str, str] | None
) -> pd.DataFrame:
    """Return the first rows of other gears where all of a frame are of one.

    Args:
        dataset: of which the frame is the first rows.
        frame: indexed by their places there.
        columns: as in `read_case`.
    """
    whose = [name for name in frame if quantity_of(str(name), columns) == "specimen"]
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


def placed(
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

    def told(wrong: Finding) -> Finding:
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
        raise InputError(map(told, error.findings)) from None
    left_out = {gear: told(wrong) for gear, wrong in case.left_out.items()}
    return replace(case, left_out=left_out)


def quantity_of(header: str, columns: Mapping[str, str] | None) -> str:
    """Return which quantity a header is taken for, or said to be."""
    said = {name: quantity for quantity, name in (columns or {}).items()}
    return said.get(header, parse_header(header).quantity)


def runs_told(frame: pd.DataFrame, gear, columns, asked) -> dict[str, np.ndarray]:
    """Return a column of runs where dates, rigs and operators tell them, or none.

    What is wrong with rows or the gear file is told when they are read.
    """
    with suppress(InputError):
        found, _ = gear_of(gear, None, False, asked)
        named = dict(found.source.get("columns", {})) | dict(columns or {})
        measured = read_measurements(frame, named, skip_bad=True)
        if measured.mounted:
            runs = np.full(len(frame), "left out", object)
            # Below a line of headers.
            place = measured.columns.table.rows - 2
            runs[place] = np.array(measured.run.names)[measured.run.index]
            return {"run": runs}
    return {}
