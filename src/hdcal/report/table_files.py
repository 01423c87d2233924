"""Tables as the content of CSV and Parquet files."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.tables.cells import without_formula


def columns_csv(columns: Mapping[str, Any]) -> str:
    """Return the text of a CSV file; no cell is a formula for a spreadsheet."""
    frame = pd.DataFrame(dict(columns)).rename(columns=without_formula).infer_objects()
    for name in frame.select_dtypes(exclude="number"):
        frame[name] = frame[name].map(_cell, na_action="ignore").astype(object)
    # So that cells with \r or \n are quoted.
    text = frame.to_csv(index=False, float_format="%.9g", lineterminator="\r\n")
    return text.replace("\r\n", "\n")


def frame_parquet(frame: pd.DataFrame) -> bytes | None:
    """Return the content of a Parquet file; None if pyarrow is not installed."""
    try:
        return frame.to_parquet(index=False)
    except ImportError:  # pip install "hdcal[files]"
        return None


def _cell(value: Any) -> Any:
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    return without_formula(value) if isinstance(value, str) else value
