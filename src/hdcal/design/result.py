"""The base of the results of designs and studies."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.design.gears import Gears
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


class DesignResult(Result):
    """What the results of designs and studies share.

    Attributes:
        source: the gear that is to be changed, for each draw.
        materials: of the gears in the answer.
        far_sizes: sizes more than a fifth off those of the tested gear [mm].
        untested: least and largest value of a deformation [mm] or temperature [°C]
            that no reading covers, and those of the readings.
        interval: probability inside the intervals.
    """

    source: InstanceOf[Gears] = Field(exclude=True)
    materials: tuple[str, ...] = Field(exclude=True)
    far_sizes: dict[str, float] = Field(exclude=True)
    untested: dict[str, tuple[Ends, Ends]] = Field(exclude=True)
    gear: dict[str, str]
    basis: Literal["posterior", "prior"]
    draws: int
    interval: float = Field(default=INTERVAL, gt=0.0, lt=1.0)
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
    gears: Gears, deformation: Any, temperature: Any, sizes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the fields of every design.

    Args:
        gears: of the tested gear's drawing, with scatter if there is any.
        deformation: radial, of any sign [mm].
        temperature: [°C].
        sizes: that differ from the tested gear's [mm], by name.
    """
    scatter = gears.shifts or np.any(gears.deviation)
    kind, untested, far = "predictive" if scatter else "credible", {}, {}
    if gears.model is None:
        kind = "prior predictive" if scatter else "prior"
    else:
        records = gears.model.case.records
        radial = np.asarray(records.deformation) * gears.radial_per_read
        for name, asked, tested, near in (
            ("deformation", deformation, radial, 1e-9),
            # Thermometers are no better than 1 K.
            ("temperature", temperature, records.temperature, 1.0),
        ):
            (low, high), ends = _ends(asked), _ends(tested)
            if low < ends[0] - near or high > ends[1] + near:
                untested[name] = (low, high), ends
    for name, values in sizes.items():
        value = max(
            np.ravel(values), key=lambda v: abs(np.log(v / gears.size_of(name)))
        )
        if abs(np.log(value / gears.size_of(name))) > np.log(_FAR_SIZE):
            far[name] = float(value)
    gear = gears.gear
    return {
        "source": gears,
        "far_sizes": far,
        "untested": untested,
        "gear": {"name": gear.name, "material": gear.material, "theory": gears.theory},
        "basis": "prior" if gears.model is None else "posterior",
        "draws": gears.size,
        "interval_kind": f"equal-tailed {kind} interval",
    }


def _ends(values: Any) -> Ends:
    return float(np.min(values)), float(np.max(values))


def counted(share: float, gears: Gears) -> tuple[float, float]:
    """Return a probability that was counted among draws, and its standard error.

    All draws do not make it certain: half a draw remains uncertain.
    """
    size = gears.independent
    share = float(np.clip(share, 0.5 / size, 1.0 - 0.5 / size))
    return share, float(np.sqrt(share * (1.0 - share) / size))


def stress_fields(gears: Gears, stress: np.ndarray) -> dict[str, Interval | None]:
    """Return the fields of `Stress` from the stress of each draw [MPa]."""
    fields, strength = {"stress_MPa": stress}, gears.strengths()
    if strength is not None:
        fields |= {"yield_MPa": strength, "utilisation": stress / strength}
    names = Stress.model_fields
    return {n: Interval.of(fields[n]) if n in fields else None for n in names}
