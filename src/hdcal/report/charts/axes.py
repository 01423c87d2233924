"""Words of the axes that many charts share."""

from hdcal.data.case import Case
from hdcal.quantities import Quantities


def displacement_axis(case: Case) -> str:
    """Return the axis of the deformation as read, radial or diametral."""
    units = case.units
    word, unit = units.displacement, units.displacement_unit
    kind = case.gear.read_as if units.is_force else ""
    reading = f" ({kind})" if kind else ""
    return f"{word} as read{reading} [{unit}]"


def load_axis(units: Quantities, words: str = "") -> str:
    """Return an axis of forces: what it shows, by default the force, and the unit."""
    return f"{words or units.load} [{units.load_unit}]"
