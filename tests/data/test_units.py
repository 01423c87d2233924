"""The table of common units agrees with pint, and odd units never pass."""

import math

import numpy as np
import pytest

from hdcal.data import units
from hdcal.data.units import COLUMN_UNITS, UnitError, column_to_code, to_code

PINT_NAMES = {"%": "percent", "in": "inch", "°C": "delta_degC", "degC": "delta_degC"}
PINT_NAMES |= {"degF": "delta_degF", "K": "kelvin"}


@pytest.mark.parametrize("name", units._ATOMS)
def test_the_table_is_what_pint_says(name):
    scale, powers = units._from_pint(PINT_NAMES.get(name, name))
    assert units._ATOMS[name][0] == pytest.approx(scale, rel=1e-12)
    assert units._ATOMS[name][1] == powers


@pytest.mark.parametrize("quantity", COLUMN_UNITS)
def test_columns_are_what_pint_says(quantity):
    import pint

    registry = pint.UnitRegistry()
    spelled = {"C": "degC", "K": "kelvin", "F": "degF", "in": "inch"}
    target = spelled.get(COLUMN_UNITS[quantity][0], COLUMN_UNITS[quantity][0])
    values = np.array([0.0, 1.0, 300.0])
    for unit in COLUMN_UNITS[quantity]:
        there = registry.Quantity(values, spelled.get(unit, unit)).to(target)
        here = column_to_code(values, quantity, unit)
        assert here == pytest.approx(there.magnitude, rel=1e-12, abs=1e-9)


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
     "N//mm", "*", "import os", "__class__", "mm" * 50, "²", "1e99*1e99*1e99*1e99"],
)  # fmt: skip
def test_what_is_no_unit(text):
    with pytest.raises(UnitError):
        to_code(text)
