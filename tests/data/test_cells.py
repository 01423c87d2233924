"""The fast way through NumPy reads what the slow way reads, or nothing."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hdcal.data.tables.cells import read_number
from hdcal.data.tables.grid import TextGrid


def read(cell: str) -> np.ndarray:
    grid = TextGrid(np.array([1]), 2, [], ";", [f"0;{cell}"], '"' in cell)
    return grid.read([1])[1]


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
    fast = read(cell)
    if fast.dtype != object:  # else the slow way decides
        assert fast[0] == read_number(cell.strip(), "," in cell)


@pytest.mark.parametrize("exponent", [-300, -5, 0, 7, 300])
def test_the_nearest_double(exponent):
    number = math.pi * 10.0**exponent
    assert read(repr(number)).tolist() == [number]
