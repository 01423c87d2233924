"""Columns as the content of a Parquet file, each of its own kind."""

from collections.abc import Mapping

import numpy as np


def columns_parquet(columns: Mapping[str, np.ndarray]) -> bytes | None:
    """Return columns as the content of a Parquet file; None where pyarrow is missing.

    Args:
        columns: of numbers, texts or yes and no; what is None or NaN becomes null.
    """
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:  # pip install "hdcal[files]"
        return None
    arrays = {name: pyarrow.array(v, from_pandas=True) for name, v in columns.items()}
    target = pyarrow.BufferOutputStream()
    parquet.write_table(pyarrow.table(arrays), target)
    return target.getvalue().to_pybytes()
