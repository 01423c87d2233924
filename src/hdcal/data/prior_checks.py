"""What the numbers of a prior can be, whoever wrote them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from hdcal.data.plausible import RANGES, out_of_range, range_of
from hdcal.data.prior import FAMILIES

_SIGNED = (
    "alpha",
    "force_offset",
    "deformation_offset",
    "spring_alpha",
    "cte",
    "initial_deformation",
    "initial_velocity",
)
_SIZES = ("sd", "log_sd", "median", "a", "b")


class Fault(NamedTuple):
    """What is wrong with one number of a prior.

    Attributes:
        number: its name in the family.
        problem: what is wrong.
        remedy: what to do.
    """

    number: str
    problem: str
    remedy: str


def family_faults(family: str, numbers: Sequence[float]) -> list[Fault]:
    """Return which numbers no prior of a family has, in any unit.

    Args:
        family: a key of `FAMILIES`.
        numbers: of the family, in its order; NaN for what is no number.
    """
    faults = []
    for name, number in zip(FAMILIES[family], numbers, strict=True):
        if not math.isfinite(number):
            words, remedy = "is not a finite number", "Write a plain number"
        elif name in _SIZES and number <= 0.0:
            words, remedy = f"{number:g} is not positive", "Write its size"
        else:
            continue
        faults.append(Fault(name, words, remedy))
    if family == "uniform" and not faults and numbers[0] >= numbers[1]:
        faults.append(Fault("low", "low is not below high", "Exchange them"))
    return faults


def quantity_of_K(unit: str | None) -> str:
    """Return which range K has: of a factor, or of the stiffness that it itself is.

    Args:
        unit: of its prior.
    """
    return "spring_stiffness" if unit == "N/mm" else "K"


def sign_faults(family: str, numbers: Sequence[float], parameter: str) -> list[Fault]:
    """Return a fault where a parameter that is positive is centred below zero.

    Likewise where the correlation of the noise can be none.

    Args:
        family: of the prior.
        numbers: of the family, in any unit.
        parameter: a key of `RANGES` or `NAMES`.
    """
    if parameter == "noise_correlation":
        return _correlation_faults(family, numbers)
    if family not in ("normal", "fixed", "uniform") or parameter in _SIGNED:
        return []
    lowest, name = numbers[0], FAMILIES[family][0]
    if lowest > 0.0 or (family == "uniform" and lowest == 0.0):
        return []
    words = f"{parameter} is positive, but {name} is {lowest:g}"
    return [Fault(name, words, "Write a positive number")]


def _correlation_faults(family: str, numbers: Sequence[float]) -> list[Fault]:
    """Return a fault where a correlation could leave 0 to 1, or be 1 for certain."""
    last = float(numbers[-1])
    within = {
        "beta": True,
        "uniform": float(numbers[0]) >= 0.0 and last <= 1.0,
        # Above 1 its range speaks.
        "fixed": last >= 0.0 and last != 1.0,
    }
    if within.get(family, False):
        return []
    remedy = (
        'Write family = "beta", "uniform" within 0 and 1, or "fixed" from 0 (none) to '
        "below 1"
    )
    name = FAMILIES[family][-1] if family in within else "family"
    if family == "uniform" and last <= 1.0:
        name = "low"
    words = f"a correlation lies from 0 to below 1, and this {family} prior does not"
    return [Fault(name, words, remedy)]


def range_faults(family: str, numbers: Sequence[float], quantity: str) -> list[Fault]:
    """Return which numbers no gear and no rig can have.

    Args:
        family: of the prior.
        numbers: of the family, in code units.
        quantity: a key of `RANGES` or `NAMES`; "effect" for a parameter of an effect.
    """
    known = range_of(quantity)
    spread = known._replace(low=0.0, high=max(-known.low, known.high))
    ranges = {"log_sd": RANGES["log_sd"], "a": RANGES["beta"], "b": RANGES["beta"]}
    ranges |= {"sd": spread, "low": known._replace(low=min(known.low, 0.0))}
    return [
        Fault(name, found.problem, found.remedy)
        for name, number in zip(FAMILIES[family], numbers, strict=True)
        for found in out_of_range(name, number, ranges.get(name, known))
    ]
