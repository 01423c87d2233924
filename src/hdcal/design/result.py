"""The base of the results of designs and studies."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.design.gears import Gears
from hdcal.prediction.conditions import NEAR_K, NEAR_MM
from hdcal.report.item import INTERVAL, Interval, Item, Words, quantity
from hdcal.report.result import Result

Ends = tuple[float, float]
# Ratio to the tested size beyond which no data support K.
_FAR_SIZE = 1.2


class Stress(Item):
    """Size of the hoop bending stress, and its share of the yield strength."""

    stress_MPa: Interval = quantity("stress", "MPa")
    yield_MPa: Interval | None = quantity("yield strength", "MPa")
    utilisation: Interval | None = quantity("share of the yield strength")

    @classmethod
    def of(cls, gears: Gears, stress: np.ndarray) -> "Stress":
        """Return the intervals of the stress of each draw [MPa]."""
        strength, size = gears.strengths(), Interval.of(stress)
        if strength is None:
            return cls(stress_MPa=size, yield_MPa=None, utilisation=None)
        share = Interval.of(stress / strength)
        return cls(stress_MPa=size, yield_MPa=Interval.of(strength), utilisation=share)


class DesignResult(Result):
    """What the results of designs and studies share.

    Probabilities are counted among draws; half of an independent draw remains
    uncertain. `far_sizes` are more than a fifth off those of the tested gear [mm];
    `untested` has the ends of deformations [mm] or temperatures [°C] that no reading
    covers, and those of the readings.
    """

    source: InstanceOf[Gears] = Field(exclude=True)
    far_sizes: dict[str, float] = Field(exclude=True)
    untested: dict[str, tuple[Ends, Ends]] = Field(exclude=True)
    gear: dict[str, str]
    draws: int
    independent_draws: float
    interval: float
    interval_kind: Words

    @computed_field
    @property
    def answer(self) -> tuple[Words, ...]:
        """The answer in sentences."""
        return self.lines("answer")

    @computed_field
    @property
    def population(self) -> Words | None:
        """The gears that the probabilities refer to."""
        return self.line("population") or None

    @computed_field
    @property
    def assumptions(self) -> tuple[Words, ...]:
        """What the answer assumes, in sentences."""
        return self.lines("assumptions")

    @computed_field
    @property
    def warnings(self) -> tuple[Words, ...]:
        """What is extrapolated or not described by the model, in sentences."""
        return self.lines("warnings")


def shared_fields(
    gears: Gears,
    deformation: Any,
    temperature: Any,
    sizes: Mapping[Any, Any],
    interval: float = INTERVAL,
) -> dict[str, Any]:
    """Return the fields of every design, at radial deformations and temperatures.

    The sizes are those that differ from the tested gear's [mm], by name.
    """
    untested, far = {}, {}
    records = gears.model.posterior.case.records
    radial = np.asarray(records.deformation) * gears.radial_per_read
    for name, asked, tested, near in (
        ("deformation", deformation, radial, NEAR_MM),
        ("temperature", temperature, records.temperature, NEAR_K),
    ):
        ends = [float(f(v)) for v in (asked, tested) for f in (np.min, np.max)]
        if ends[0] < ends[2] - near or ends[1] > ends[3] + near:
            untested[name] = ends[:2], ends[2:]
    for name, values in sizes.items():
        ratios = np.ravel(values) / gears.size_of(name)
        farthest = float(max(ratios, key=lambda ratio: abs(np.log(ratio))))
        if abs(np.log(farthest)) > np.log(_FAR_SIZE):
            far[name] = farthest * gears.size_of(name)
    gear, kind = gears.gear, "predictive" if gears.scatters else "credible"
    return {
        "source": gears,
        "far_sizes": far,
        "untested": untested,
        "gear": {"name": gear.name, "material": gear.material, "theory": gears.theory},
        "draws": gears.model.size,
        "independent_draws": gears.independent,
        "interval": interval,
        "interval_kind": f"equal-tailed {kind} interval",
    }
