"""The one place where units are converted: at the edge, into mm, N, s, K, rad.

Units that hdcal's own files and columns use stand in a table, so that the usual
case never pays for importing pint; pint answers for every other name.
"""

import math
import re
from functools import cache
from typing import Any

import numpy as np

# quantity of a column -> the units a header may name, code unit first
COLUMN_UNITS: dict[str, tuple[str, ...]] = {
    "deformation": ("mm", "um", "m", "in"),
    "force": ("N", "kN", "kgf", "lbf"),
    "temperature": ("C", "K", "F"),
    "time": ("s", "ms", "min"),
    "angle": ("rad", "deg"),
    "force_sd": ("N", "kN", "kgf", "lbf"),
}

# Spellings of the same units that instruments write.
_ALIASES = {
    "µm": "um",  # micro sign
    "μm": "um",  # Greek mu
    "°C": "C",
    "°F": "F",
    "°": "deg",
}

Powers = tuple[int, int, int, int]  # of N, mm, s, K

_ATOMS: dict[str, tuple[float, Powers]] = {
    "N": (1.0, (1, 0, 0, 0)),
    "kN": (1e3, (1, 0, 0, 0)),
    "kgf": (9.80665, (1, 0, 0, 0)),
    "lbf": (4.4482216152605, (1, 0, 0, 0)),
    "mm": (1.0, (0, 1, 0, 0)),
    "um": (1e-3, (0, 1, 0, 0)),
    "m": (1e3, (0, 1, 0, 0)),
    "in": (25.4, (0, 1, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "ms": (1e-3, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "K": (1.0, (0, 0, 0, 1)),
    # in a prior's unit a degree is a difference, never a point on the scale
    "degC": (1.0, (0, 0, 0, 1)),
    "°C": (1.0, (0, 0, 0, 1)),
    "degF": (5 / 9, (0, 0, 0, 1)),
    "rad": (1.0, (0, 0, 0, 0)),
    "deg": (math.pi / 180, (0, 0, 0, 0)),
    "%": (1e-2, (0, 0, 0, 0)),
    "Pa": (1e-6, (1, -2, 0, 0)),
    "MPa": (1.0, (1, -2, 0, 0)),
    "GPa": (1e3, (1, -2, 0, 0)),
    "kg": (1e-3, (1, -1, 2, 0)),
}

_NUMBER = re.compile(r"\d+(\.\d*)?([eE][+-]?\d{1,2})?", re.ASCII)
_FACTOR = re.compile(r"(?P<name>[^\W\d]+|°C|%)((\^|\*\*)(?P<power>-?[1-9]))?")


class UnitError(ValueError):
    """A unit that cannot be read; the message says why, in words for the user."""


def known_unit(quantity: str, unit: str) -> str | None:
    """Canonical spelling of a column's unit, or None when it is not one."""
    unit = _ALIASES.get(unit, unit)
    return unit if unit in COLUMN_UNITS[quantity] else None


def column_to_code(values: np.ndarray, quantity: str, unit: str) -> np.ndarray:
    """Convert a column into code units.

    Args:
        values: as read, shape (n,).
        quantity: a key of COLUMN_UNITS.
        unit: one of COLUMN_UNITS[quantity].

    Returns:
        Values in mm, N, °C, s or rad, shape (n,).
    """
    if quantity == "temperature":
        if unit == "K":
            return values - 273.15
        return (values - 32.0) * (5 / 9) if unit == "F" else values
    factor = _ATOMS[unit][0]
    return values if factor == 1.0 else values * factor


def to_code(unit: str) -> tuple[float, str]:
    """Read a unit such as `GPa`, `1e-4/K` or `N*s/mm^2`.

    Returns:
        The factor that takes a number in `unit` to code units, and the name of
        that code unit (`MPa`, `1/K`, ...; `1` when dimensionless).

    Raises:
        UnitError: the text is not a product of known mechanical units.
    """
    if len(unit) > 60:
        raise UnitError("the unit is longer than any unit can be")
    factor, powers = 1.0, np.zeros(4, int)
    sign = 1
    text = unit.replace(" ", "").replace("·", "*")
    # "**" is a power, a single "*" or "/" joins factors
    for part in re.split(r"(?<!\*)(\*|/)(?!\*)", text) if text else []:
        if part in ("*", "/"):
            sign = 1 if part == "*" else -1
            continue
        scale, exponents = _factor(part, unit)
        factor *= scale**sign
        powers += sign * np.array(exponents)
    if not (0.0 < factor < math.inf):
        raise UnitError(f"'{unit}' is not a usable scale")
    return factor, _name(powers)


def _factor(part: str, unit: str) -> tuple[float, Powers]:
    if _NUMBER.fullmatch(part):
        scale = float(part)
        if not scale > 0.0:
            raise UnitError(f"'{unit}' has a scale of zero")
        return scale, (0, 0, 0, 0)
    match = _FACTOR.fullmatch(part)
    if match is None:
        raise UnitError(f"'{unit}' is not a unit")
    scale, powers = _atom(match["name"])
    power = int(match["power"] or 1)
    a, b, c, d = powers
    return scale**power, (a * power, b * power, c * power, d * power)


def _atom(name: str) -> tuple[float, Powers]:
    name = name if name == "°C" else _ALIASES.get(name, name)
    if name in _ATOMS:
        return _ATOMS[name]
    return _from_pint(name)


def _from_pint(name: str) -> tuple[float, Powers]:
    import pint

    try:
        unit: Any = _registry().parse_units(name)
        base = (1.0 * unit).to_base_units()
        scale = float(base.magnitude)
        dimension = {k: int(v) for k, v in base.dimensionality.items()}
    except (pint.PintError, AttributeError, ValueError, TypeError, KeyError) as error:
        raise UnitError(f"'{name}' is not a unit") from error
    mass, length = dimension.pop("[mass]", 0), dimension.pop("[length]", 0)
    time, kelvin = dimension.pop("[time]", 0), dimension.pop("[temperature]", 0)
    if dimension:
        raise UnitError(f"'{name}' is not a mechanical unit")
    # kg = 1e-3 N s²/mm and m = 1e3 mm
    scale *= 1e-3**mass * 1e3**length
    return scale, (mass, length - mass, time + 2 * mass, kelvin)


@cache
def _registry():
    import pint

    return pint.UnitRegistry()


def _name(powers: np.ndarray) -> str:
    if tuple(powers) == (1, -2, 0, 0):
        return "MPa"
    above, below = [], []
    for name, power in zip(("N", "mm", "s", "K"), powers, strict=True):
        size = "" if abs(power) == 1 else f"^{abs(power)}"
        if power:
            (above if power > 0 else below).append(name + size)
    return "/".join(["*".join(above) or "1", *below])
