"""Conditions and sizes of a design that no reading covers."""

from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np

from hdcal.design.design_draws import DesignDraws
from hdcal.prediction.engine.conditions import NEAR_K, NEAR_MM
from hdcal.prediction.margin.result import FAR
from hdcal.report.item import Item

# Ratio to the tested size beyond which no data support K.
_FAR_SIZE = 1.2


class Extrapolation(Item):
    """A condition outside the tested range.

    Attributes:
        name: of the condition.
        unit: of its values.
        asked: least and largest value that was asked for.
        tested: least and largest value of the readings.
        bend_N: sd of the force that a bend may add; None where none can grow.
        bend_at: deformation of this sd [mm].
        far: whether that lies beyond the tested range by more than a fifth of it.
    """

    name: Literal["deformation", "temperature"]
    unit: str
    asked: tuple[float, float]
    tested: tuple[float, float]
    bend_N: float | None = None
    bend_at: float = 0.0
    far: bool = False


def extrapolations(
    draws: DesignDraws, deformation: np.ndarray, temperature: np.ndarray
) -> Iterator[Extrapolation]:
    """Yield the conditions outside the tested range.

    Args:
        draws: of the tested gear.
        deformation: radial, of the gear [mm].
        temperature: [°C].
    """
    if draws.records is None:
        return
    radial = np.asarray(draws.records.deformation) * (
        draws.problem.reading.radial_per_read
    )
    asked, tested = _ends(deformation), _ends(radial)
    if _outside(asked, tested, NEAR_MM):
        bend = {}
        if not draws.within_tested(deformation).all():
            beyond = np.maximum(tested[0] - deformation, deformation - tested[1])
            at = float(deformation[np.argmax(beyond)])
            far = bool(np.max(beyond) > FAR * (tested[1] - tested[0]))
            bend = {"bend_N": draws.bend_sd(at), "bend_at": at, "far": far}
        yield Extrapolation(
            name="deformation", unit="mm", asked=asked, tested=tested, **bend
        )
    asked, tested = _ends(temperature), _ends(draws.records.temperature)
    if _outside(asked, tested, NEAR_K):
        yield Extrapolation(name="temperature", unit="°C", asked=asked, tested=tested)


def _ends(values) -> tuple[float, float]:
    return float(np.min(values)), float(np.max(values))


def _outside(
    asked: tuple[float, float], tested: tuple[float, float], slack: float
) -> bool:
    return asked[0] < tested[0] - slack or asked[1] > tested[1] + slack


def far_sizes(draws: DesignDraws, sizes: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Return sizes more than a fifth off those of the tested gear.

    Args:
        draws: of the tested gear.
        sizes: values [mm] by name.

    Returns:
        The value that is farthest off, by name.
    """
    found = {}
    for name, values in sizes.items():
        ratio = np.abs(np.log(values / draws.size_of(name)))
        if np.max(ratio) > np.log(_FAR_SIZE):
            found[name] = float(values[np.argmax(ratio)])
    return found
