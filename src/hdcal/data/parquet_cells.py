"""Cells of a Parquet file as numbers and labels."""

from typing import TYPE_CHECKING, Any

import numpy as np

from hdcal.data.cells import NOT_STATED
from hdcal.data.columns import Column
from hdcal.data.dates import day_text
from hdcal.data.findings import FileFindings
from hdcal.data.header_words import GROUPINGS
from hdcal.data.plausible import RANGES
from hdcal.data.units import column_to_code
from hdcal.errors import quoted

if TYPE_CHECKING:
    from pyarrow import RecordBatch


def number_cells(
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


def label_cells(
    batch: "RecordBatch", column: Column, row: int, findings: FileFindings
) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of each row's label, and the labels."""
    from pyarrow import compute, types

    cells = batch.column(column.header)
    if types.is_timestamp(cells.type):
        # A day is told, as clocks there showed it, not when each reading was taken.
        zoned = cells.type.tz is not None
        # Functions that no stubs know of.
        known: Any = compute
        cells = known.local_timestamp(cells) if zoned else cells
        cells = known.floor_temporal(cells, unit="day")
    if not types.is_dictionary(cells.type):
        cells = cells.dictionary_encode()
    named = [_text(label) for label in cells.dictionary.to_pylist()]
    if column.quantity == "date":
        named = [day_text(text) for text in named]
    texts, place = np.unique([*named, ""], return_inverse=True)
    index = np.where(cells.is_null(), len(named), cells.indices.fill_null(0))
    index = place.ravel()[index]
    empty = index == int(np.flatnonzero(texts == "")[0])
    if column.quantity not in GROUPINGS:
        words, remedy = f"the {column.quantity} label is empty", "Name it"
        each = ((row + int(at), words, remedy) for at in np.flatnonzero(empty))
        findings.add_rows(each, column.header, "empty labels")
    return index, np.where(texts == "", NOT_STATED, texts).astype(object)


def _text(label: Any) -> str:
    """Return a label as text: a number is one, whatever kind it has in a file."""
    if isinstance(label, float) and label.is_integer():
        label = int(label)
    return "" if label is None else " ".join(str(label).split())
