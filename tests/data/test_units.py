"""Units are what their definitions say, to the last digit, and odd ones never pass."""

import math

import numpy as np
import pytest

from hdcal.data.units import SIZES, UNITS, UnitError, find_unit, to_code

# By definition: the kilogram-force by standard gravity, pound and inch by the
# international agreement of 1959. A degree is a difference here.
PRIORS = {
    "": (1.0, "1"),
    "N": (1.0, "N"),
    "kgf": (9.80665, "N"),
    "in": (25.4, "mm"),
    "min": (60.0, "s"),
    "degF": (5 / 9, "K"),
    "bar": (0.1, "MPa"),
    "N/mm**2": (1.0, "MPa"),
    "1/hour": (1 / 3600, "1/s"),
    "lbf": (4.4482216152605, "N"),
    "µm": (1e-3, "mm"),
    "°C": (1.0, "K"),
    "deg": (math.pi / 180, "1"),
    "%": (1e-2, "1"),
    "GPa": (1e3, "MPa"),
    "psi": (0.006894757, "MPa"),
    "kg": (1e-3, "N*s^2/mm"),
    "1e-4/K": (1e-4, "1/K"),
    "kg/m^3": (1e-12, "N*s^2/mm^4"),
    "N·s/m": (1e-3, "N*s/mm"),
}
# Reading 300 of each unit of a column, in mm, N, N*m, rad, s and °C.
COLUMNS = {
    "K": 26.85,
    "°F": (300 - 32) * 5 / 9,
    "mN": 0.3,
    "kip": 300 * 4448.2216152605,
    "mil": 7.62,
    "um": 0.3,
    "sec": 300.0,
    "gf": 2.941995,
    "kN": 3e5,
    "ozf": 300 * 4.4482216152605 / 16,
    "arcmin": math.radians(5),
    "N·m": 300.0,
    "lbf·in": 300 * 4.4482216152605 * 0.0254,
}


@pytest.mark.parametrize("name", PRIORS)
def test_a_unit_of_a_prior(name):
    factor, unit = to_code(name)
    assert (factor, unit) == (pytest.approx(PRIORS[name][0], rel=1e-6), PRIORS[name][1])


@pytest.mark.parametrize("name", COLUMNS)
def test_a_unit_of_a_column(name):
    found = find_unit(f"({name})").convert(np.array([300.0]))
    assert found[0] == pytest.approx(COLUMNS[name], rel=1e-15)


def test_no_spelling_means_two_units():
    spellings = [
        one for sizes in SIZES.values() for names in sizes for one in names.split()
    ]
    assert len(spellings) == len(UNITS)


@pytest.mark.parametrize(
    "text",
    ["furlongs per", "mm**9**9", "mm^99", "A", "0/K", "1e-999", "-1/K", "N//mm", "*",
     "__class__", "mm" * 50, "²", "1e99*1e99*1e99*1e99", "dB"],
)  # fmt: skip
def test_no_unit(text):
    with pytest.raises(UnitError):
        to_code(text)
