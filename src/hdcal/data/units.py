"""The one place where units are read and converted: at the edge, by Pint.

Inside hdcal everything is in mm, N, s, K (a temperature in °C) and rad.
"""

import math
import re
from collections.abc import Iterable
from fractions import Fraction
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
    "degC": "C",
    "degF": "F",
    "°": "deg",
}
_PINT_NAMES = {"C": "degC", "F": "degF"}  # coulomb and farad to Pint

_CODE_UNITS = ("N", "mm", "s", "K")
# Scale and powers of what shipped priors are written in: Pint's definitions take longer
# to read than a posterior.
_ATOMS = {
    **{u: (1.0, [u == one for one in _CODE_UNITS]) for u in _CODE_UNITS},
    "m": (1e3, [0, 1, 0, 0]),
    "kg": (1e-3, [1, -1, 2, 0]),
    "MPa": (1.0, [1, -2, 0, 0]),
    "GPa": (1e3, [1, -2, 0, 0]),
}
_DIMENSIONS = ("[mass]", "[length]", "[time]", "[temperature]")
_NUMBER = re.compile(r"\d+(\.\d*)?([eE][+-]?\d{1,2})?", re.ASCII)
_FACTOR = re.compile(r"(?P<name>[^\W\d]+|°C|%)((\^|\*\*)(?P<power>-?[1-9]))?")


class UnitError(ValueError):
    """A unit that cannot be read; the message says why, in words for the user."""


def known_unit(quantity: str, unit: str) -> str | None:
    """Canonical spelling of a column's unit, or None when it is not one.

    A quantity without units, such as a label, has the empty one.
    """
    unit = _ALIASES.get(unit, unit)
    return unit if unit in COLUMN_UNITS.get(quantity, ("",)) else None


def column_to_code(values: np.ndarray, quantity: str, unit: str) -> np.ndarray:
    """Convert a column into code units.

    Args:
        values: as read, shape (n,).
        quantity: a key of COLUMN_UNITS.
        unit: one of COLUMN_UNITS[quantity].

    Returns:
        Values in mm, N, °C, s or rad, shape (n,).
    """
    code = COLUMN_UNITS[quantity][0]
    if unit == code:
        return values
    here, there = (_PINT_NAMES.get(name, name) for name in (unit, code))
    quantity_of = _registry().Quantity
    zero = quantity_of(Fraction(0), there).to(here).magnitude
    scale = quantity_of(zero + 1, here).to(there).magnitude
    return (values - float(zero)) * float(scale)


def to_code(unit: str) -> tuple[float, str]:
    """Read a unit such as `GPa`, `1e-4/K` or `N*s/mm^2`.

    A degree is a difference here, never a point on the scale.

    Returns:
        The factor that takes a number in `unit` to code units, and the name of
        that code unit (`MPa`, `1/K`, ...; `1` when dimensionless).

    Raises:
        UnitError: the text is not a product of known mechanical units.
    """
    factor, powers = _product(unit)
    return factor, _name(powers)


def unit_powers(unit: str) -> tuple[int, ...]:
    """Return the powers of N, mm, s and K in a unit.

    Raises:
        UnitError: as `to_code`.
    """
    return tuple(map(int, _product(unit)[1]))


@cache
def _product(unit: str) -> tuple[float, np.ndarray]:
    """Scale of a product of units, and its powers of the code units."""
    if len(unit) > 60:
        raise UnitError("the unit is longer than any unit can be")
    factor, powers = 1.0, np.zeros(len(_CODE_UNITS), int)
    sign = 1
    text = unit.replace(" ", "").replace("·", "*")
    # "**" is a power, a single "*" or "/" joins factors
    for part in re.split(r"(?<!\*)(\*|/)(?!\*)", text) if text else []:
        if part in ("*", "/"):
            sign = 1 if part == "*" else -1
            continue
        scale, own = _factor(part, unit)
        factor *= scale**sign
        powers += sign * own
    if not (0.0 < factor < math.inf):
        raise UnitError(f"'{unit}' is not a usable scale")
    return factor, powers


def _factor(part: str, unit: str) -> tuple[float, np.ndarray]:
    """Scale of one factor, and its powers of the code units.

    The grammar is that of a product and no more: Pint would evaluate any sum.
    """
    if _NUMBER.fullmatch(part):
        scale = float(part)
        if not scale > 0.0:
            raise UnitError(f"'{unit}' has a scale of zero")
        return scale, np.zeros(len(_CODE_UNITS), int)
    match = _FACTOR.fullmatch(part)
    if match is None:
        raise UnitError(f"'{unit}' is not a unit")
    scale, powers = _atom(match["name"])
    power = int(match["power"] or 1)
    return scale**power, powers * power


@cache
def _atom(name: str) -> tuple[float, np.ndarray]:
    if name in _ATOMS:
        scale, powers = _ATOMS[name]
        return scale, np.array(powers, int)
    return _of_pint(name)


def _of_pint(name: str) -> tuple[float, np.ndarray]:
    import pint

    quantity = _registry().Quantity
    try:
        # from zero to one of the unit: for degrees the zero is not the absolute one
        zero, one = (quantity(Fraction(n), name).to_root_units() for n in (0, 1))
        step, dimensions = one - zero, dict(one.dimensionality)
    except (pint.PintError, AttributeError, ValueError, TypeError, KeyError) as error:
        raise UnitError(f"'{name}' is not a unit") from error
    mass, length, time, kelvin = (dimensions.pop(key, 0) for key in _DIMENSIONS)
    powers = [mass, length - mass, time + 2 * mass, kelvin]
    if dimensions or any(power % 1 for power in powers):
        raise UnitError(f"'{name}' is not a mechanical unit")
    # exact until this last step, which rounds once
    return float(step.to(_name(powers)).magnitude), np.array(powers, int)


def _name(powers: Iterable[int]) -> str:
    """The code unit of these powers of N, mm, s and K."""
    if tuple(powers) == (1, -2, 0, 0):
        return "MPa"
    above, below = [], []
    for name, power in zip(_CODE_UNITS, powers, strict=True):
        size = "" if abs(power) == 1 else f"^{abs(power)}"
        if power:
            (above if power > 0 else below).append(name + size)
    return "/".join(["*".join(above) or "1", *below])


@cache
def _registry() -> Any:
    import pint

    exact: Any = Fraction  # Pint's own hint says float
    return pint.UnitRegistry(non_int_type=exact)
