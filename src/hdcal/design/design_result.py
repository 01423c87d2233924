"""The base of the results of designs and studies."""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.data.theory_names import Theory
from hdcal.design.design_draws import DesignDraws
from hdcal.design.extrapolation import Extrapolation
from hdcal.report.item import INTERVAL, Count, Interval, Item, Words, quantity
from hdcal.report.result import Result

Numbers = tuple[float, ...]
Ends = tuple[float, float]


class DesignedGear(Item):
    """The gear that the draws belong to."""

    name: str
    material: str
    theory: Theory


class Stress(Item):
    """Size of the hoop bending stress, and its share of the yield strength."""

    stress_MPa: Interval = quantity("stress", "MPa")
    yield_MPa: Interval | None = quantity("yield strength", "MPa")
    utilisation: Interval | None = quantity("share of the yield strength")


class DesignResult(Result):
    """What the results of designs and studies share.

    Attributes:
        source: draws of the gear that is to be changed.
        materials: of the gears in the answer.
        extrapolations: conditions that no reading covers.
        far_sizes: sizes more than a fifth off those of the tested gear [mm].
        interval: probability inside the intervals.
        interval_kind: what kind of interval they are.
    """

    source: InstanceOf[DesignDraws] = Field(exclude=True)
    materials: tuple[str, ...] = Field(exclude=True)
    extrapolations: tuple[Extrapolation, ...] = Field(exclude=True)
    far_sizes: dict[str, float] = Field(default_factory=dict, exclude=True)
    interval: float = Field(default=INTERVAL, gt=0.0, lt=1.0)
    interval_kind: Words

    @computed_field
    @property
    def gear(self) -> DesignedGear:
        """The gear that the draws belong to."""
        source = self.source
        return DesignedGear(
            name=source.gear.name, material=source.gear.material, theory=source.theory
        )

    @computed_field
    @property
    def basis(self) -> Literal["posterior", "prior"]:
        """Whether the draws are those of a posterior or of a prior."""
        return self.source.kind

    @computed_field
    @property
    def draws(self) -> Count:
        """Number of draws."""
        return self.source.size

    @computed_field
    @property
    def answer(self) -> tuple[Words, ...]:
        """The answer in sentences."""
        return self.lines("answer")

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

    @property
    def prior_only(self) -> bool:
        """Whether no gear was measured."""
        return self.source.kind == "prior"

    @property
    def needs(self) -> frozenset[str]:
        """Covariates that the calibrated effects need."""
        return frozenset().union(*(one.needs for one in self.source.problem.effects))

    def own_size(self, name: str) -> float:
        """Return a size of the tested gear [mm], such as that of `radius_mm`."""
        return self.source.size_of(name)


def counted(share: float, draws: DesignDraws) -> tuple[float, float]:
    """Return a probability that was counted among draws, and its standard error.

    All draws do not make it certain: half a draw remains uncertain.
    """
    size = draws.independent
    share = float(np.clip(share, 0.5 / size, 1.0 - 0.5 / size))
    return share, float(np.sqrt(share * (1.0 - share) / size))


def stress_fields(draws: DesignDraws, stress: np.ndarray) -> Mapping[str, Any]:
    """Return the fields of `Stress`.

    Args:
        draws: of the material.
        stress: of each draw [MPa].
    """
    strength = draws.yield_strength
    known = strength is not None
    return {
        "stress_MPa": Interval.of(stress),
        "yield_MPa": Interval.of(strength) if known else None,
        "utilisation": Interval.of(stress / strength) if known else None,
    }
