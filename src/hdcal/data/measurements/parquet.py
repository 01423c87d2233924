"""Parquet, a file or a folder of them: read in batches, whatever the number of rows."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from hdcal.data.case import Gear
from hdcal.data.findings import FileFindings
from hdcal.data.measurements.gear_files import GEAR_NAME
from hdcal.data.measurements.measurements import Measurements, measured_in
from hdcal.data.measurements.notes import source_notes
from hdcal.data.measurements.screened import asked_range
from hdcal.data.reading import gear_of
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.columns import (
    REQUIRED,
    Column,
    as_named,
    choose_columns,
    in_place_of_force,
)
from hdcal.data.tables.grid import frame_grid
from hdcal.data.tables.headers import GROUPINGS
from hdcal.data.tables.parquet_files import (
    frame_of,
    parquet_files,
    parquet_table,
    plain_columns,
)
from hdcal.data.tables.sources import file_sha256, table_of

if TYPE_CHECKING:
    from pyarrow import Schema, Table
    from pyarrow.dataset import Dataset

# Rows by which the columns are chosen, and rows of a batch.
_SHOWN, _BATCH = 50_000, 1 << 18
_USED = (*REQUIRED, "angle", "torque", "temperature", "time", "specimen", "run")
_USED += GROUPINGS


@dataclass(frozen=True)
class Parquet:
    """Files that are read in batches, with the columns and the gear of all of them."""

    name: str
    gear: Gear
    files: Sequence[str]
    root: str  # folder of the files; empty where there is one file
    schema: "Schema"
    used: Mapping[str, Column]
    named: dict[str, str]
    notes: tuple[str, ...]
    range: str | None

    @property
    def sha256(self) -> str:
        """Hash of the file, or of the hashes of several."""
        each = [file_sha256(name) for name in self.files]
        several = hashlib.sha256("".join(each).encode()).hexdigest()
        return each[0] if len(each) == 1 else several


def open_parquet(
    data: Path | str,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    range: str | None = None,
) -> Parquet:
    """Look into a Parquet file, or a folder of them, partitioned or not."""
    path = Path(data)
    files = parquet_files(path)
    root = str(path) if path.is_dir() else ""
    nearby = (path if root else path.parent) / GEAR_NAME
    asked_range(range)
    with FileFindings(str(path)) as findings:
        dataset = parquet_table(files, root, findings)
        common, notes = gear_of(gear, nearby, False)
        named = {**common.source.get("columns", {}), **(columns or {})}
        first = dataset.head(_SHOWN, columns=plain_columns(dataset.schema))
        table = table_of(frame_grid(frame_of(first)), findings)
        chosen = choose_columns(table, named, _USED, REQUIRED, findings)
        used = in_place_of_force(chosen)
        if "specimen" not in used:
            remedy = "Name the column of the gears: `columns` specimen=HEADER"
            findings.refuse("no column names the gear of each row", remedy)
    return Parquet(
        name=path.resolve().name if root else path.stem,
        gear=common,
        files=files,
        root=root,
        schema=dataset.schema,
        used=used,
        named=as_named(table, used),
        notes=(*source_notes(table, used), *notes),
        range=range or common.source.get("measurement", {}).get("range"),
    )


def read_batches(
    source: Parquet, file: str, *, skip_bad: bool | None = None
) -> Iterator[Measurements]:
    """Yield the rows of one file of a source, in their order, not screened."""
    with FileFindings(file) as findings:
        dataset = parquet_table([file], source.root, findings)
    dataset = dataset.replace_schema(source.schema)
    names = plain_columns(source.schema)
    headers = [names[column.position] for column in source.used.values()]
    places = {q: place for place, q in enumerate(source.used)}
    used = {q: replace(column, position=places[q]) for q, column in source.used.items()}
    for first, rows in _whole_gears(dataset, headers, places["specimen"]):
        with FileFindings(file) as findings:
            frame = frame_of(rows)
            # Times would be as many labels as rows: of dates the day counts.
            for name in frame.select_dtypes(["datetime", "datetimetz"]):
                days = frame[name].dt.tz_localize(None).dt.normalize()
                frame[name] = days.astype("category")
            grid = frame_grid(frame, first)
            table = ReadTable(tuple(headers), first, grid)
            how: dict = {"skip_bad": skip_bad, "whole": False}
            read = measured_in(table, used, findings, source.gear, **how)
        yield read


def _whole_gears(
    dataset: "Dataset", headers: list[str], specimen: int
) -> Iterator[tuple[int, "Table"]]:
    """Yield rows that end with those of a gear, and the number of the first."""
    import pyarrow

    held, first = None, 1
    for batch in dataset.to_batches(columns=headers, batch_size=_BATCH):
        rows = pyarrow.Table.from_batches([batch])
        labels = pd.factorize(batch.column(specimen).to_pandas())[0]
        others = np.flatnonzero(labels != labels[-1:])
        end = int(others[-1]) + 1 if others.size else 0
        parts = [rows[:end]] if held is None else [held, rows[:end]]
        held = rows[end:] if end else pyarrow.concat_tables([*parts[:-1], rows])
        if end:
            whole = pyarrow.concat_tables(parts)
            yield first, whole
            first += whole.num_rows
    if held is not None and held.num_rows:
        yield first, held
