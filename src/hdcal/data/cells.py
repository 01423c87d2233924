"""The cells of a table as numbers and labels."""

import io
import math
import re
from collections.abc import Hashable
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.columns import LABELS, Column
from hdcal.data.layout import LISTED, Layout, and_more
from hdcal.errors import Finding

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_ENDLESS = re.compile(r"[+-]?(inf|infinity|nan)", re.IGNORECASE)

# The nearest double, not a fast approximation of it: the same file must give the
# same posterior everywhere. From 3.1 on pandas does so unasked, and warns if asked.
_OLD = tuple(int(part) for part in pd.__version__.split(".")[:2]) < (3, 1)
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if _OLD else {}

Values = dict[str, np.ndarray]


def read_cells(
    layout: Layout, columns: dict[str, Column], file: str
) -> tuple[Values, list[Finding]]:
    """Read the used columns.

    Args:
        layout: of the table.
        columns: by quantity.
        file: how the user named the file.

    Returns:
        Floats in the file's units (NaN where a cell is wrong) or label strings,
        each of shape (n,), and a finding for each wrong cell.
    """
    numeric = [c for c in columns.values() if c.quantity not in LABELS]
    labels = [c for c in columns.values() if c.quantity in LABELS]
    values, findings = _labels(layout, labels, file)
    texts: list[Column] = numeric
    if numeric and layout.body:
        try:
            fast = _parse(layout, {c.position: "float64" for c in numeric})
        except ValueError:
            fast = {}
        values |= {
            c.quantity: fast[c.position].to_numpy()
            for c in numeric
            if c.position in fast and np.isfinite(fast[c.position].to_numpy()).all()
        }
        texts = [c for c in numeric if c.quantity not in values]
    if texts:
        slow, wrong = _texts(layout, texts, file)
        values |= slow
        findings += wrong
    return values, findings


def _parse(layout: Layout, types: dict[int, str]):
    if not layout.body or not types:
        return pd.DataFrame({position: [] for position in types}, dtype=str)
    dtypes: dict[Hashable, Any] = {**types}
    return pd.read_csv(
        io.BytesIO(layout.body),
        sep=layout.separator,
        header=None,
        names=list(range(len(layout.headers))),
        index_col=False,
        usecols=list(types),
        dtype=dtypes,
        decimal="," if _decimal_comma(layout) else ".",
        engine="c",
        **_EXACT,
        skipinitialspace=True,
        skip_blank_lines=False,
        keep_default_na=False,
        na_values=[""],
        low_memory=False,
        quoting=0 if layout.quoted else 3,
    )


def _decimal_comma(layout: Layout) -> bool:
    return layout.separator != "," and b"," in layout.body


def _labels(
    layout: Layout, columns: list[Column], file: str
) -> tuple[Values, list[Finding]]:
    frame = _parse(layout, {c.position: "str" for c in columns})
    values: Values = {}
    findings: list[Finding] = []
    for column in columns:
        texts = frame[column.position].fillna("").str.strip().to_numpy(object)
        empty = np.flatnonzero(texts == "")
        for index in empty[:LISTED]:
            row = int(layout.rows[index])
            words = f"the {column.quantity} label is empty"
            findings.append(Finding(file, words, "Name it", row, column.header))
        findings += and_more(len(empty), "empty labels", file, column.header)
        values[column.quantity] = texts
    return values, findings


def _texts(
    layout: Layout, columns: list[Column], file: str
) -> tuple[Values, list[Finding]]:
    """The slow way, cell by cell, for columns that hold something odd."""
    frame = _parse(layout, {c.position: "str" for c in columns})
    values: Values = {}
    findings: list[Finding] = []
    for column in columns:
        cells = frame[column.position].fillna("").to_list()
        comma = layout.separator != "," and any("," in cell for cell in cells)
        numbers, wrong = np.full(len(cells), np.nan), 0
        for index, cell in enumerate(cells):
            number, complaint = _number(cell.strip(), comma)
            if complaint is None:
                numbers[index] = number
                continue
            wrong += 1
            if wrong <= LISTED:
                row = int(layout.rows[index])
                findings.append(Finding(file, *complaint, row, column.header))
        findings += and_more(wrong, "cells that are no numbers", file, column.header)
        values[column.quantity] = numbers
    return values, findings


def _number(cell: str, comma: bool) -> tuple[float, tuple[str, str] | None]:
    if not cell:
        return math.nan, ("the cell is empty", "Fill it in or leave out the row")
    if _ENDLESS.fullmatch(cell):
        words = f"'{cell}' is not a finite number"
        return math.nan, (words, "Leave out the row if nothing was read")
    point = cell
    if comma:
        if "." in cell and "," not in cell and any(map(str.isdigit, cell)):
            words = f"'{_shown(cell)}' has a decimal point among decimal commas"
            return math.nan, (words, "Use one decimal sign in the whole column")
        point = cell if "." in cell else cell.replace(",", ".")
    if not _NUMBER.fullmatch(point):
        return math.nan, (f"'{_shown(cell)}' is not a number", "Write a plain number")
    number = float(point)
    if math.isinf(number):
        words = f"'{_shown(cell)}' is too large for a finite number"
        return math.nan, (words, "Check the cell")
    return number, None


def _shown(cell: str) -> str:
    # what stands in the file goes to a terminal: neither long nor with escapes
    text = "".join(c if c.isprintable() else "�" for c in cell)
    return text if len(text) <= 40 else text[:40] + "…"
