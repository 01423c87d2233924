"""Units are what their definitions say, to the last digit, and odd ones never pass."""

import math

import numpy as np
import pytest

from hdcal.data.units import SIZES, UNITS, UnitError, find_unit, to_code

# By definition: the kilogram-force by standard gravity, pound and inch by the
# international agreement of 1959. A degree is a difference here.
DEFINED = {
    "N": (1.0, "N"),
    "kN": (1e3, "N"),
    "kgf": (9.80665, "N"),
    "lbf": (4.4482216152605, "N"),
    "mm": (1.0, "mm"),
    "um": (1e-3, "mm"),
    "µm": (1e-3, "mm"),
    "μm": (1e-3, "mm"),
    "m": (1e3, "mm"),
    "in": (25.4, "mm"),
    "s": (1.0, "s"),
    "ms": (1e-3, "s"),
    "min": (60.0, "s"),
    "K": (1.0, "K"),
    "degC": (1.0, "K"),
    "°C": (1.0, "K"),
    "celsius": (1.0, "K"),
    "degF": (5 / 9, "K"),
    "rad": (1.0, "1"),
    "deg": (math.pi / 180, "1"),
    "%": (1e-2, "1"),
    "Pa": (1e-6, "MPa"),
    "MPa": (1.0, "MPa"),
    "GPa": (1e3, "MPa"),
    "bar": (0.1, "MPa"),
    "kg": (1e-3, "N*s^2/mm"),
}


@pytest.mark.parametrize("name", DEFINED)
def test_a_unit_is_what_its_definition_says(name):
    assert to_code(name) == DEFINED[name]


# What units of columns are in mm, N, N*m, rad, s and °C: reading 300 of each.
COLUMNS = {
    "K": 26.85,
    "°F": (300 - 32) * 5 / 9,
    "gf": 2.941995,
    "mN": 0.3,
    "kip": 300 * 4448.2216152605,
    "ozf": 300 * 4.4482216152605 / 16,
    "mil": 7.62,
    "arcmin": math.radians(5),
    "N·m": 300.0,
    "mNm": 0.3,
    "lbf·in": 300 * 4.4482216152605 * 0.0254,
    "sec": 300.0,
}


@pytest.mark.parametrize("name", COLUMNS)
def test_a_column_is_what_its_unit_says(name):
    found = find_unit(f"({name})").convert(np.array([300.0]))
    assert found[0] == pytest.approx(COLUMNS[name], rel=1e-15)


def test_no_spelling_means_two_units():
    spellings = [
        one for sizes in SIZES.values() for names in sizes for one in names.split()
    ]
    assert len(spellings) == len(UNITS)


@pytest.mark.parametrize(
    ("text", "factor", "name"),
    [
        ("", 1.0, "1"),
        ("1", 1.0, "1"),
        ("GPa", 1e3, "MPa"),
        ("N/mm^2", 1.0, "MPa"),
        ("N/mm**2", 1.0, "MPa"),
        ("psi", 0.006894757, "MPa"),
        ("1e-4/K", 1e-4, "1/K"),
        ("1e-6 / °C", 1e-6, "1/K"),
        ("%", 0.01, "1"),
        ("kg/m^3", 1e-12, "N*s^2/mm^4"),
        ("N·s/m", 1e-3, "N*s/mm"),
        ("1/hour", 1 / 3600, "1/s"),
        ("deg", math.pi / 180, "1"),
        ("mm/s/K", 1.0, "mm/s/K"),
    ],
)
def test_units_of_priors(text, factor, name):
    scale, unit = to_code(text)
    assert scale == pytest.approx(factor, rel=1e-6)
    assert unit == name


@pytest.mark.parametrize(
    "text",
    ["furlongs per", "mm**9**9", "9**9**9", "mm^99", "A", "0/K", "1e-999", "-1/K",
     "N//mm", "*", "import os", "__class__", "mm" * 50, "²", "1e99*1e99*1e99*1e99",
     "dB", "gauss"],
)  # fmt: skip
def test_what_is_no_unit(text):
    with pytest.raises(UnitError):
        to_code(text)
