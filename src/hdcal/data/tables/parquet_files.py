"""Parquet files as one table: their columns, and the types of these."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from hdcal.data.findings import FileFindings
from hdcal.data.tables.grid import Grid, frame_grid

if TYPE_CHECKING:
    from pyarrow import Schema, Table
    from pyarrow.dataset import Dataset

PARQUET = b"PAR1"  # first bytes of a Parquet file
# Tables of other kinds, of which a folder is a case.
_OTHERS = {".csv", ".txt", ".tsv", ".xlsx", ".lvm", ".dat"}


def is_parquet(data: Any) -> bool:
    """Tell whether data are a Parquet file, or a folder of such and no other tables."""
    if not isinstance(data, str | Path):
        return False
    path = Path(data)
    if path.is_dir():
        others = (one for one in path.iterdir() if one.suffix.lower() in _OTHERS)
        return not any(others) and bool(parquet_files(path))
    try:
        with path.open("rb") as file:
            return file.read(len(PARQUET)) == PARQUET
    except OSError:
        return False


def parquet_files(path: Path) -> list[str]:
    """Return the files of a folder, those of folders in it among them."""
    if not path.is_dir():
        return [str(path)]
    files = (one for one in path.rglob("*.parquet") if one.is_file())
    # Files that engines add to their tables begin so.
    return sorted(str(one) for one in files if one.name[0] not in "._")


def parquet_table(files: Sequence[str], root: str, findings: FileFindings) -> "Dataset":
    """Return files as one table; names of folders such as `lot=7` are texts."""
    try:
        import pyarrow as arrow
        from pyarrow import dataset as tables
    except ImportError:
        words = "is Parquet, which needs pyarrow"
        findings.refuse(words, 'pip install "hdcal[files]"')
    below = [Path(file).relative_to(root).parts[:-1] if root else () for file in files]
    keys = dict.fromkeys(p.split("=")[0] for parts in below for p in parts if "=" in p)
    kinds = arrow.schema([(key, arrow.string()) for key in keys])
    split = {
        "partitioning": tables.partitioning(kinds, flavor="hive"),
        "partition_base_dir": root,
    }
    try:
        table = tables.dataset([*files], format="parquet", **split if keys else {})
        schemas = [one.physical_schema for one in table.get_fragments()]
    except Exception as error:  # whatever a parser makes of a broken file
        words = f"is not a readable Parquet file ({error})"
        findings.refuse(words, "Write the file again")
    schema = arrow.schema([])
    for name, one in zip([*files, root], [*schemas, kinds], strict=True):
        try:
            # A column that is empty in a file, or narrower, is no other kind.
            schema = arrow.unify_schemas([schema, one], promote_options="permissive")
        except arrow.ArrowTypeError as error:
            words = f"the columns of {name} have other types ({error})"
            findings.refuse(words, "Write the file again")
    return table.replace_schema(schema)


def plain_columns(schema: "Schema") -> list[str]:
    """Return the columns that hold plain cells."""
    from pyarrow import types

    return [field.name for field in schema if not types.is_nested(field.type)]


def frame_of(table: "Table") -> pd.DataFrame:
    """Return a table of Arrow as a DataFrame, its texts as categories."""
    from pyarrow import types

    for place, field in enumerate(table.schema):
        if types.is_string(field.type) or types.is_large_string(field.type):
            coded = table.column(place).dictionary_encode()
            table = table.set_column(place, field.name, coded)
    return table.to_pandas()


def parquet_grid(path: Path, findings: FileFindings) -> Grid:
    """Return the grid of a Parquet file."""
    dataset = parquet_table([str(path)], "", findings)
    table = dataset.to_table(columns=plain_columns(dataset.schema), use_threads=False)
    return frame_grid(frame_of(table))
