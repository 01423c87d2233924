"""Columns as the text of a CSV file."""

import csv
import io
from collections.abc import Mapping

import numpy as np

from hdcal.data.formula_cells import without_formula


def columns_csv(columns: Mapping[str, np.ndarray]) -> str:
    """Return columns as the text of a CSV file."""
    target = io.StringIO()
    # It quotes a cell for the characters that end lines: both of them, so that no cell
    # begins a line.
    writer = csv.writer(target, lineterminator="\r\n")
    writer.writerow(map(without_formula, columns))
    texts = [[_cell(value) for value in column.tolist()] for column in columns.values()]
    writer.writerows(zip(*texts, strict=True))
    return target.getvalue().replace("\r\n", "\n")


def _cell(value) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        # A millionth of a newton is far below any reading.
        return "" if value != value else f"{value:.9g}"
    return without_formula(str(value)) if isinstance(value, str) else str(value)
