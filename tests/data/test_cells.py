"""The fast way through pandas reads what the slow way reads, or nothing."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hdcal.data.cells import read_number
from hdcal.data.csv_table import CsvTable, split_table
from hdcal.data.findings import FileFindings


def table_of(cell: str) -> CsvTable:
    findings = FileFindings("file")
    table = split_table(f"a;b\n0;{cell}\n".encode(), findings)
    assert not findings
    return table


@settings(max_examples=400, deadline=None)
@given(st.text("0123456789+-.eExX_, naif'", min_size=1, max_size=8))
@example("1_0")
@example("0x10")
@example("1,5")
@example("1.5,")
@example("- 1")
@example("1e")
@example("+1E 2")
@example("Infinity")
def test_one_cell(cell):
    fast = table_of(cell).numbers([1])
    if fast:  # else the slow way decides
        assert fast[1][0] == read_number(cell.strip(), "," in cell)


@pytest.mark.parametrize("exponent", [-300, -5, 0, 7, 300])
def test_the_nearest_double(exponent):
    number = math.pi * 10.0**exponent
    assert table_of(repr(number)).numbers([1])[1].tolist() == [number]
