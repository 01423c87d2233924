"""The sense of loading: which way a force is the larger one.

Deformation and force are signed: positive where the gear is pressed, negative where it
is pulled. A capacity has a size only, so that a force is compared with one *along the
sense of loading*: multiplied by +1 where the gear is pressed at the deformation asked
for, by −1 where it is pulled. Whoever bounds, ranks or limits a force does so along
that sense; what is published as a force or a deformation gets its sign back. A mirrored
question about mirrored data has the mirrored answer, then.
"""

from collections.abc import Sequence
from typing import Literal

from hdcal.errors import Finding
from hdcal.prediction.engine.causes import Cause
from hdcal.quantities import FORCE, Quantities
from hdcal.report.intervals import Interval

# +1: pressed, deformation and force are positive; −1: pulled, both are negative.
LoadingSense = Literal[1, -1]


def sense_of(value: float) -> LoadingSense:
    """Return the sense of a gear's own deformation, or of a force on it."""
    return -1 if value < 0.0 else 1


def loading_sense(causes: Sequence[Cause], deformation: float) -> LoadingSense:
    """Return the sense in which the gear is loaded at a deformation.

    It is the sign of the gear's own deformation, the zero of the gauge taken off, in
    the larger share of the draws.

    Args:
        causes: of all models.
        deformation: as read [mm].
    """
    pressed = sum(
        float(cause.weights @ (cause.values["deformation_offset"] <= deformation))
        for cause in causes
    )
    return 1 if pressed >= 0.5 else -1


def ends_along(low: float, high: float, sense: LoadingSense) -> tuple[float, float]:
    """Return two ends along the sense of loading, from their signed values.

    It is its own inverse: from ends along the sense it returns the signed ones.

    Args:
        low: the smaller.
        high: the larger.
        sense: of loading.
    """
    return (low, high) if sense > 0 else (-high, -low)


def interval_along(median, low, high, sense: LoadingSense) -> Interval:
    """Return an interval as `ends_along` does."""
    return Interval(sense * median, *ends_along(low, high, sense))


def capacity_findings(
    name: str,
    capacity: float,
    sense: LoadingSense,
    place: str,
    units: Quantities = FORCE,
) -> list[Finding]:
    """Return why a capacity cannot be one of the force; empty where it can.

    It is a size, in either sense of loading, or has the sign of the force.

    Args:
        name: of the parameter.
        capacity: as given [N].
        sense: of loading.
        place: where the force is asked for, as in "0.4 mm".
        units: of what was measured.
    """
    if not capacity < 0.0 < sense:
        return []
    unit = units.load_unit
    words = f"{capacity:g} {unit} is no limit of the {units.load} at {place}, which is "
    words += "positive"
    remedy = f"Give {-capacity:g} {unit}, or ask at a negative {units.displacement}"
    return [Finding(name, words, remedy)]
