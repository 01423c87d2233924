"""gears.parquet says what gears.csv says, each column of its own kind."""

import io
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
from fleets import handmade
from pyarrow import parquet

from hdcal.data.formula_cells import with_formula
from hdcal.errors import Finding
from hdcal.fleets.fleet import Fleet
from hdcal.fleets.summary import fleet_report
from hdcal.report.table_files import columns_parquet
from hdcal.report.write import write_numbers

KINDS = {pa.float64(), pa.int64(), pa.bool_(), pa.string()}


def kind(of: pa.DataType) -> pa.DataType:
    """Type of a column; the version of pandas decides which one texts have."""
    return pa.string() if pa.types.is_large_string(of) else of


def hostile() -> Fleet:
    """Return the gears of `handmade`, called as no gear should be."""
    found = handmade()
    names = ("=1+1", "0012", "true", "Größe,\n7")
    case = replace(found.case, specimen_labels=names)
    return replace(found, readings=replace(found.readings, case=case))


def with_one_left_out() -> Fleet:
    found = handmade()
    why = {"E": Finding("line.csv", "'abc' is not a number", "Mend it", 7)}
    return replace(found, readings=found.readings.without(why))


@pytest.mark.parametrize("make", [handmade, hostile, with_one_left_out])
def test_both_files_say_the_same(make, tmp_path: Path):
    write_numbers(fleet_report(make()), tmp_path)
    table = parquet.read_table(tmp_path / "gears.parquet")
    text = pd.read_csv(tmp_path / "gears.csv", dtype=str, keep_default_na=False)
    assert table.column_names == [*text.columns] and len(table) == len(text)
    assert {*map(kind, table.schema.types)} == KINDS
    for name in table.column_names:
        column, cells = table.column(name), [*text[name]]
        # What a cell leaves empty is null; a text may be empty itself.
        nulls = [cell == "" for cell in cells]
        if kind(column.type) != pa.string():
            assert column.is_null().to_pylist() == nulls
        for value, cell in zip(column.to_pylist(), cells, strict=True):
            if isinstance(value, bool):
                assert cell == str(value).lower()
            elif isinstance(value, float):
                assert float(cell) == pytest.approx(value, rel=1e-8)
            else:
                assert with_formula(cell) == ("" if value is None else str(value))


def test_kinds_are_those_of_the_numbers_whether_gears_are_left_out_or_not(tmp_path):
    schemas = []
    for make in (handmade, with_one_left_out):
        (folder := tmp_path / make.__name__).mkdir()
        write_numbers(fleet_report(make()), folder)
        schemas.append(parquet.read_schema(folder / "gears.parquet"))
    assert schemas[0].equals(schemas[1])
    kinds = dict(zip(schemas[0].names, map(kind, schemas[0].types), strict=True))
    assert kinds["gear"] == kinds["status"] == kinds["off_in"] == pa.string()
    assert kinds["rows"] == kinds["runs"] == pa.int64()
    assert kinds["called_off"] == pa.bool_() and kinds["K"] == pa.float64()


def test_a_column_is_what_it_was_and_the_same_bytes():
    columns = {
        "x": np.array([1 / 3, np.nan]),
        "n": np.array([2**60, -1]),
        "yes": np.array([True, False]),
        "name": np.array(["=1", ""]),
    }
    content = columns_parquet(columns)
    assert content is not None and content == columns_parquet(columns)
    found = parquet.read_table(io.BytesIO(content)).to_pydict()
    assert found == {
        "x": [1 / 3, None],
        "n": [2**60, -1],
        "yes": [True, False],
        "name": ["=1", ""],
    }


def test_without_pyarrow_there_is_gears_csv_alone(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    write_numbers(fleet_report(handmade()), tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"gears.csv", "summary.json", "posterior.nc"}
