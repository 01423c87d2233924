"""The one table of units, and the conversion of columns and priors by it.

Inside hdcal everything is in mm, N, s, K (a temperature in °C) and rad; a torque is in
N*m.
"""

import math
import re
import unicodedata
from functools import cache
from typing import NamedTuple

import numpy as np

_GRAVITY = 9.80665  # standard gravity [m/s²]
_POUND = 4.4482216152605  # pound-force [N]
_INCH = 25.4  # [mm]
_DEGREE = math.pi / 180.0  # [rad]
# Size of each unit in the first one of its dimension; other spellings stand behind the
# usual one.
SIZES: dict[str, dict[str, float]] = {
    "length": {
        "mm": 1.0,
        "um µm μm": 1e-3,
        "m": 1e3,
        "in inch": _INCH,
        "cm": 10.0,
        "nm": 1e-6,
        "mil thou": 1e-3 * _INCH,
    },
    "force": {
        "N": 1.0,
        "kN": 1e3,
        "kgf kp": _GRAVITY,
        "lbf": _POUND,
        "mN": 1e-3,
        "cN": 1e-2,
        "daN": 10.0,
        "MN": 1e6,
        "gf": 1e-3 * _GRAVITY,
        "ozf": _POUND / 16.0,
        "kip kipf kips": 1e3 * _POUND,
    },
    "torque": {
        "Nm": 1.0,
        "mNm": 1e-3,
        "kNm": 1e3,
        "Nmm": 1e-3,
        "Ncm": 1e-2,
        "kgfm": _GRAVITY,
        "kgfcm": 1e-2 * _GRAVITY,
        "lbfin inlbf": 1e-3 * _INCH * _POUND,
        "lbfft ftlbf": 12e-3 * _INCH * _POUND,
        "ozfin inozf": 1e-3 * _INCH * _POUND / 16.0,
    },
    "angle": {
        "rad": 1.0,
        "deg °": _DEGREE,
        "mrad": 1e-3,
        "arcmin ′": _DEGREE / 60.0,
        "arcsec ″": _DEGREE / 3600.0,
    },
    "time": {
        "s sec secs second seconds": 1.0,
        "ms msec": 1e-3,
        "min minutes": 60.0,
        "us µs μs": 1e-6,
        "h hr hour hours": 3600.0,
    },
    "temperature": {"C °C degC celsius": 1.0, "K": 1.0, "F °F degF": 5.0 / 9.0},
}
_ZEROS = {"K": 273.15, "F": 32.0}  # reading in a unit at the zero of °C
# Further units of priors: sizes in N, mm, s and K, and their powers.
_OF_PRIORS = {
    "MPa": (1.0, (1, -2, 0, 0)),
    "Pa": (1e-6, (1, -2, 0, 0)),
    "kPa": (1e-3, (1, -2, 0, 0)),
    "GPa": (1e3, (1, -2, 0, 0)),
    "bar": (0.1, (1, -2, 0, 0)),
    "psi": (_POUND / _INCH**2, (1, -2, 0, 0)),
    "kg": (1e-3, (1, -1, 2, 0)),
    "g": (1e-6, (1, -1, 2, 0)),
    "J": (1e3, (1, 1, 0, 0)),
    "W": (1e3, (1, 1, -1, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "%": (1e-2, (0, 0, 0, 0)),
}
_CODE_UNITS = ("N", "mm", "s", "K")
_NONE = (0, 0, 0, 0)
_POWERS = {
    "force": (1, 0, 0, 0),
    "length": (0, 1, 0, 0),
    "time": (0, 0, 1, 0),
    "temperature": (0, 0, 0, 1),
    "angle": _NONE,
}
_NUMBER = re.compile(r"\d+(\.\d*)?([eE][+-]?\d{1,2})?", re.ASCII)
_FACTOR = re.compile(r"(?P<name>[^\W\d]+|°[CF]?|[%′″])((\^|\*\*)(?P<power>-?[1-9]))?")
_LONGEST = 60


class Unit(NamedTuple):
    """Unit of a column; the dimension is a key of `SIZES`."""

    name: str
    dimension: str
    size: float  # in the first unit of the dimension
    zero: float = 0.0  # reading in this unit at the zero of that one

    def convert(self, values: np.ndarray) -> np.ndarray:
        """Convert values, shape (n,), into mm, N, N*m, rad, s or °C."""
        if self.zero:
            values = values - self.zero
        return values if self.size == 1.0 else values * self.size


UNITS = {
    spelling: Unit(name := names.split()[0], dimension, size, _ZEROS.get(name, 0.0))
    for dimension, sizes in SIZES.items()
    for names, size in sizes.items()
    for spelling in names.split()
}


class UnitError(ValueError):
    """A unit that cannot be read; the message says why, in words for the user."""


def find_unit(text: str) -> Unit | None:
    """Return the unit of a text such as '(N·m)'; None of any other text."""
    bare = unicodedata.normalize("NFC", text.strip().strip("()[]").strip())
    # Factors of a torque are joined in many ways.
    return UNITS.get(bare) or UNITS.get(re.sub(r"[\s·⋅*.-]", "", bare))


def to_code(unit: str) -> tuple[float, str]:
    """Return the factor to code units of a unit such as `N*s/mm^2`, and their name.

    A degree is a difference. The name is `MPa`, `1/K`, ...; `1` when dimensionless.

    Raises:
        UnitError: the text is not a product of known mechanical units.
    """
    factor, powers = _product(unit)
    if powers == (1, -2, 0, 0):
        return factor, "MPa"
    above, below = [], []
    for name, power in zip(_CODE_UNITS, powers, strict=True):
        size = "" if abs(power) == 1 else f"^{abs(power)}"
        if power:
            (above if power > 0 else below).append(name + size)
    return factor, "/".join(["*".join(above) or "1", *below])


def unit_powers(unit: str) -> tuple[int, ...]:
    """Return the powers of N, mm, s and K in a unit, as `to_code` reads it."""
    return _product(unit)[1]


@cache
def _product(unit: str) -> tuple[float, tuple[int, ...]]:
    """Return the scale of a product of units, and its powers of the code units."""
    if len(unit) > _LONGEST:
        raise UnitError("the unit is too long")
    factor, powers, sign = 1.0, _NONE, 1
    text = unit.replace(" ", "").replace("·", "*")
    # "**" is a power, a single "*" or "/" joins factors
    for part in re.split(r"(?<!\*)(\*|/)(?!\*)", text) if text else []:
        if part in ("*", "/"):
            sign = 1 if part == "*" else -1
            continue
        scale, its_powers = _factor(part, unit)
        factor *= scale**sign
        powers = tuple(p + sign * q for p, q in zip(powers, its_powers, strict=True))
    if not (0.0 < factor < math.inf):
        raise UnitError(f"'{unit}' is too large or too small")
    return factor, powers


def _factor(part: str, unit: str) -> tuple[float, tuple[int, ...]]:
    if _NUMBER.fullmatch(part):
        if not float(part) > 0.0:
            raise UnitError(f"'{unit}' has a scale of zero")
        return float(part), _NONE
    match = _FACTOR.fullmatch(part)
    if match is None:
        raise UnitError(f"'{unit}' is not a unit")
    name, power = match["name"], int(match["power"] or 1)
    known = UNITS.get(name)
    if name in _OF_PRIORS:
        scale, powers = _OF_PRIORS[name]
    elif known is not None and known.dimension in _POWERS:
        scale, powers = known.size, _POWERS[known.dimension]
    else:
        raise UnitError(f"'{name}' is not a unit")
    return scale**power, tuple(power * p for p in powers)
