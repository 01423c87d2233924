"""The fast way through pandas reads what the slow way reads, or nothing."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hdcal.data.cells import _number, _parse
from hdcal.data.layout import lay_out


@settings(max_examples=400, deadline=None)
@given(st.text("0123456789+-.eExX_, naif'", min_size=1, max_size=8))
@example("1_0")
@example("0x10")
@example("1,5")
@example("1.5,")
@example("- 1")
@example("1e")
@example("Infinity")
def test_one_cell(cell):
    layout, findings = lay_out(f"a;b\n0;{cell}\n".encode(), "file")
    assert not findings
    try:
        fast = float(_parse(layout, {1: "float64"})[1][0])
    except ValueError:
        return  # the slow way decides
    if math.isfinite(fast):
        slow, complaint = _number(cell.strip(), "," in cell)
        assert complaint is None
        assert fast == slow


@pytest.mark.parametrize("exponent", [-300, -5, 0, 7, 300])
def test_the_nearest_double(exponent):
    number = math.pi * 10.0**exponent
    layout, _ = lay_out(f"a;b\n0;{number!r}\n".encode(), "file")
    assert float(_parse(layout, {1: "float64"})[1][0]) == number
