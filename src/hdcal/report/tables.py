"""The main table of a result, as columns by name."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, is_dataclass
from numbers import Number
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def own_columns(found: Any) -> Any:
    """Return the columns that a result has itself."""
    columns: Any = found.columns
    return columns() if callable(columns) else columns


def as_columns(table: Any) -> dict[str, Any]:
    """Return a table as columns.

    Args:
        table: columns by name; or rows, mappings or dataclasses, these also by name. Of
            a row what is a number or a text; what it holds inside as outer_inner.
    """
    if isinstance(table, Mapping) and not any(map(is_dataclass, table.values())):
        return dict(table)
    named = isinstance(table, Mapping)
    rows: Iterable = table.values() if named else table
    flat = [_flat(row if isinstance(row, Mapping) else asdict(row)) for row in rows]
    columns: dict[str, Any] = {"name": list(table)} if named else {}
    for key in dict.fromkeys(key for row in flat for key in row):
        columns[key] = [row.get(key) for row in flat]
    return columns


def datatree(columns: Mapping[str, Any]) -> "xr.DataTree":
    """Return columns over one dimension, `row`."""
    import xarray as xr

    arrays = {name: ("row", np.asarray(column)) for name, column in columns.items()}
    return xr.DataTree(xr.Dataset(arrays))


def _flat(row: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{before}{key}_")
        elif value is None or isinstance(value, Number | str | np.generic):
            found[f"{before}{key}"] = value
    return found
