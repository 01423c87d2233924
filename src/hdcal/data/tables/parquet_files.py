"""Parquet files as one table: which ones, and of which kinds their columns are."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hdcal.data.findings import FileFindings
from hdcal.data.tables.arrays import arrow_grid
from hdcal.data.tables.grid import ArrayGrid
from hdcal.data.tables.headers import parse_header
from hdcal.errors import InputError, quoted

if TYPE_CHECKING:
    from pyarrow import Schema
    from pyarrow.dataset import Dataset

# What a Parquet file begins with.
PARQUET = b"PAR1"
_REMEDY = "Save it anew"
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
    found = (one for one in path.rglob("*.parquet") if one.is_file())
    # What engines leave beside their files begins so.
    return sorted(str(one) for one in found if one.name[0] not in "._")


def parquet_table(files: Sequence[str], root: str, findings: FileFindings) -> "Dataset":
    """Return files as one table; what folders are called are texts.

    Args:
        files: some of those of a folder, or one.
        root: the folder; empty where it is one file.
        findings: of the data.

    Raises:
        InputError: they cannot be read, or a column is of several kinds.
    """
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
        found = tables.dataset([*files], format="parquet", **split if keys else {})
        each = [one.physical_schema for one in found.get_fragments()]
        return found.replace_schema(_joined([*each, kinds], files, findings))
    except InputError:
        raise
    except Exception as error:  # whatever a parser makes of a broken file
        findings.refuse(f"is no Parquet file that can be read ({error})", _REMEDY)


def _joined(schemas, files: Sequence[str], findings: FileFindings) -> "Schema":
    """Return the columns of all files; one that has several kinds is refused."""
    import pyarrow as arrow

    fields: dict[str, list] = {}
    for place, schema in enumerate(schemas):
        for field in schema:
            fields.setdefault(field.name, []).append((place, field))
    whole = []
    for name, several in fields.items():
        try:
            # No file is asked for what is nothing in it, or shorter.
            schema = arrow.unify_schemas(
                [arrow.schema([field]) for _, field in several],
                promote_options="permissive",
            )
            whole.append(schema.field(0))
        except arrow.ArrowTypeError:
            (_, first), (at, other) = (
                several[0],
                next(one for one in several if one[1].type != several[0][1].type),
            )
            words = (
                f"{quoted(name)} is {other.type} in {files[at]}, {first.type} before"
            )
            if parse_header(name).quantity:
                findings.add(words, _REMEDY)
    if findings:
        raise InputError(findings)
    return arrow.schema(whole)


def parquet_grid(path: Path, findings: FileFindings) -> tuple[ArrayGrid, list[str]]:
    """Return the grid of a Parquet file, and nothing that was assumed.

    Raises:
        InputError: it is none, or pyarrow is missing.
    """
    dataset = parquet_table([str(path)], "", findings)

    def column(name: str) -> Any:
        return dataset.to_table(columns=[name], use_threads=False).column(0)

    return arrow_grid(dataset.schema, column, dataset.count_rows(), 2), []
