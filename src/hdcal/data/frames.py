"""Tables in memory: to the text that files are read from, and from columns."""

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.findings import FileFindings

# What findings call it.
NAME = "DataFrame"


def is_frame(data: Any) -> bool:
    """Tell whether this is a table in memory: a data frame, or arrays by name."""
    return (
        isinstance(data, Mapping)
        or hasattr(data, "to_csv")
        or hasattr(data, "to_pandas")
    )


def frame_of(columns: Mapping[str, Any]) -> pd.DataFrame:
    """Return columns by name as a data frame."""
    return pd.DataFrame({name: np.asarray(each) for name, each in columns.items()})


def frame_text(data: Any, findings: FileFindings) -> tuple[bytes, str, str]:
    """Return a table as text, cells separated by tabs, as `read_text` does.

    Args:
        data: a pandas DataFrame, another library's that can become one, or a mapping of
            names to arrays of one length.
        findings: of the table.

    Raises:
        InputError: arrays of several lengths, or of more than one dimension; headers
            of several levels.
    """
    if hasattr(data, "to_pandas"):
        data = data.to_pandas()
    try:
        frame = pd.DataFrame(data)
    except (ValueError, TypeError) as error:
        remedy = "Give arrays of one length and one dimension, by name"
        findings.refuse(f"is no table ({error})", remedy)
    if frame.columns.nlevels > 1:
        remedy = "Name each by one text, as in frame.columns.map('_'.join)"
        findings.refuse("has columns of several levels", remedy)
    # Each number in full, so that it is read back as it is.
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    # Columns that are only counted have no headers: they are asked for by number.
    named = not all(str(name).isdigit() for name in frame.columns)
    text = frame.to_csv(sep="\t", index=False, header=named, lineterminator="\n")
    utf8 = text.encode()
    return utf8, hashlib.sha256(utf8).hexdigest(), ""
