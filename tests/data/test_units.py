"""Units are what their definitions say, to the last digit, and odd ones never pass."""

import math

import numpy as np
import pytest

from hdcal.data.units import (
    _ATOMS,
    COLUMN_UNITS,
    UnitError,
    _of_pint,
    column_to_code,
    to_code,
)

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
# Where the code unit's zero lies, and the size of the unit in it.
COLUMNS = {name: (0.0, factor) for name, (factor, _) in DEFINED.items()}
COLUMNS |= {"C": (0.0, 1.0), "K": (273.15, 1.0), "F": (32.0, 5 / 9)}


@pytest.mark.parametrize("name", DEFINED)
def test_a_unit_is_what_its_definition_says(name):
    assert to_code(name) == DEFINED[name]


@pytest.mark.parametrize("quantity", COLUMN_UNITS)
def test_columns_are_what_the_definitions_say(quantity):
    values = np.array([0.0, 1.0, 300.0])
    for unit in COLUMN_UNITS[quantity]:
        zero, factor = COLUMNS[unit]
        found = column_to_code(values, quantity, unit)
        assert found.tolist() == ((values - zero) * factor).tolist()


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


@pytest.mark.parametrize("name", _ATOMS)
def test_what_is_known_without_pint_is_what_pint_says(name):
    scale, powers = _of_pint(name)
    assert (scale, powers.tolist()) == (_ATOMS[name][0], [*map(int, _ATOMS[name][1])])
