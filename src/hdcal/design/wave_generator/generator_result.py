"""The result of the search for the spring of a wave generator."""

from collections.abc import Mapping
from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field, InstanceOf, computed_field

from hdcal.design.design_result import (
    DesignResult,
    Ends,
    Numbers,
    Stress,
    counted,
    stress_fields,
)
from hdcal.design.next_gear import NextGear
from hdcal.design.ring_chart import ring_chart
from hdcal.design.wave_generator.charts import balance_panel, probability_panel
from hdcal.design.wave_generator.springs import Spring, set_points
from hdcal.design.wave_generator.window import WindowAsked
from hdcal.physics.profile import peak_stress
from hdcal.prediction.engine.loading_sense import ends_along
from hdcal.report.chart_spec import Chart
from hdcal.report.item import Draws, Interval, Item, Probability, Words, quantity


class ChosenSpring(Item):
    """The softest spring that keeps the window, with one set point for every gear."""

    rate_N_per_mm: float = quantity("spring rate", "N/mm")
    softest_considered: bool
    rate_over_gear: float = quantity("spring rate over the stiffness of the gear")
    interference_mm: float = quantity("set point", "mm")
    probability: Probability = quantity("probability inside the window")
    standard_error: float = quantity("standard error of the probability")
    zero_backlash: Probability = quantity("probability of no backlash")
    no_jam: Probability = quantity("probability of no jam")


class SetPoint(Item):
    """The middle of the window at the temperature nearest to the reference."""

    deformation_mm: float = quantity("deformation", "mm")
    temperature_C: float = quantity("temperature", "°C")
    force_N: Interval = quantity("force", "N")


class WindowForces(Item):
    """Forces at both ends and in the middle of the window, at one temperature."""

    temperature_C: float = quantity("temperature", "°C")
    at_lo: Interval = quantity("force at the lower end", "N")
    at_middle: Interval = quantity("force in the middle", "N")
    at_hi: Interval = quantity("force at the upper end", "N")


class WindowKept(Item):
    """Probabilities with one set point for every gear, at one temperature."""

    temperature_C: float = quantity("temperature", "°C")
    zero_backlash: Probability = quantity("probability of no backlash")
    no_jam: Probability = quantity("probability of no jam")
    inside: Probability = quantity("probability inside the window")


class GearByGear(Item):
    """Set points that are adjusted gear by gear, with the same spring."""

    probability: Probability = quantity("probability inside the window")
    share_of_gears: float
    interference_mm: Ends = quantity("range of the set point", "mm")
    preload_N: Ends = quantity("range of the preload", "N")


class SpringCurve(Item):
    """Probabilities over the spring rate."""

    rate_N_per_mm: Numbers = quantity("spring rate", "N/mm")
    common: tuple[Probability, ...] = quantity("one set point for every gear")
    zero_backlash: tuple[Probability, ...] = quantity("probability of no backlash")
    no_jam: tuple[Probability, ...] = quantity("probability of no jam")
    adjusted: tuple[Probability, ...] = quantity("each gear adjusted")


class StressAtWindow(Stress):
    """The stress at the end of the window that is the farther one from zero."""

    deformation_mm: float = quantity("deformation", "mm")


class WaveGenerator(DesignResult):
    """The softest spring of an elastic wave generator that keeps a window.

    Inside, springs, forces and set points are along the sense of loading.

    Attributes:
        asked: window, temperatures and probability.
        next_gear: the gears that have to stay in the window.
        springs: every rate that was considered, softest first.
        chosen: the softest that meets the requirement.
        forces: F at the least deformation, in the middle and at the largest, at each
            temperature [N]: [3, T, draw].
        error: of each draw's set point as built [mm], shape (draw,).
    """

    template = "design/wave_generator/report.md.j2"
    table = "springs"

    format: Literal["hdcal.design/1"] = "hdcal.design/1"
    kind: Literal["wave_generator"] = "wave_generator"
    asked: WindowAsked
    next_gear: InstanceOf[NextGear] = Field(exclude=True)
    springs: tuple[Spring, ...] = Field(exclude=True)
    chosen: Spring = Field(exclude=True)
    forces: Draws
    error: Draws

    @computed_field
    @property
    def population(self) -> Words:
        """The gears that the probabilities refer to."""
        return self.line("population")

    @computed_field
    @cached_property
    def spring(self) -> ChosenSpring:
        """The softest spring that keeps the window."""
        spring, draws = self.chosen, self.source
        middle = np.median(self.forces[1, self._reference])
        stiffness = self.asked.sense * middle / self.asked.middle_mm
        probability, error = counted(spring.together, draws)
        return ChosenSpring(
            rate_N_per_mm=spring.rate,
            softest_considered=spring.rate == self.springs[0].rate,
            rate_over_gear=spring.rate / float(stiffness),
            interference_mm=self.asked.sense * spring.interference,
            probability=probability,
            standard_error=error,
            zero_backlash=counted(spring.no_backlash, draws)[0],
            no_jam=counted(spring.no_jam, draws)[0],
        )

    @computed_field
    @cached_property
    def set_point(self) -> SetPoint:
        """The middle of the window at the reference temperature."""
        level = self._reference
        return SetPoint(
            deformation_mm=self.asked.middle_mm,
            temperature_C=self.asked.temperature_C[level],
            force_N=Interval.of(self.asked.sense * self.forces[1, level]),
        )

    @computed_field
    @cached_property
    def force_N(self) -> tuple[WindowForces, ...]:
        """Forces at each temperature."""
        sense = self.asked.sense
        found = []
        for level, temperature in enumerate(self.asked.temperature_C):
            lo, middle, hi = map(Interval.of, sense * self.forces[::sense, level])
            found.append(
                WindowForces(
                    temperature_C=temperature, at_lo=lo, at_middle=middle, at_hi=hi
                )
            )
        return tuple(found)

    @computed_field
    @cached_property
    def at_temperature(self) -> tuple[WindowKept, ...]:
        """Probabilities at each temperature."""
        x, found = self.chosen.interference + self.error, []
        for level, temperature in enumerate(self.asked.temperature_C):
            low, high = self._intervals(self.forces[:, level : level + 1])
            kept = x >= low, x <= high, (x >= low) & (x <= high)
            shares = (counted(float(np.mean(each)), self.source)[0] for each in kept)
            names = "zero_backlash", "no_jam", "inside"
            fields = dict(zip(names, shares, strict=True))
            found.append(WindowKept(temperature_C=temperature, **fields))
        return tuple(found)

    @computed_field
    @cached_property
    def adjusted(self) -> GearByGear:
        """The range of set points if each gear has its own."""
        share, sense = self.asked.probability, self.asked.sense
        middle = 0.5 * np.sum(self._intervals(self.forces), axis=0)
        ends = np.array([0.5 - share / 2.0, 0.5 + share / 2.0])
        reach = np.quantile(middle, ends)
        load = self.chosen.rate * (reach - sense * self.asked.middle_mm)
        return GearByGear(
            probability=counted(self.chosen.adjusted, self.source)[0],
            share_of_gears=share,
            interference_mm=ends_along(reach[0], reach[1], sense),
            preload_N=ends_along(load[0], load[1], sense),
        )

    @computed_field
    @cached_property
    def curve(self) -> SpringCurve:
        """Probabilities over the spring rate."""

        def column(name: str) -> Numbers:
            shares = (getattr(spring, name) for spring in self.springs)
            return tuple(counted(share, self.source)[0] for share in shares)

        return SpringCurve(
            rate_N_per_mm=tuple(spring.rate for spring in self.springs),
            common=column("together"),
            zero_backlash=column("no_backlash"),
            no_jam=column("no_jam"),
            adjusted=column("adjusted"),
        )

    @computed_field
    @cached_property
    def stress(self) -> StressAtWindow:
        """Hoop bending stress at the largest deformation."""
        draws, at = self.source, self.asked.sizes_mm[1]
        rise = np.asarray(self.asked.temperature_C) - draws.gear.reference_temperature
        warm = np.max(1.0 - np.asarray(draws.values["alpha"])[:, None] * rise, axis=1)
        modulus = np.asarray(draws.values["E0"]) * warm
        made = self.next_gear.gears.made(draws.gear.geometry)
        stress = np.asarray(peak_stress(made, modulus, at))
        where = self.asked.sense * at
        return StressAtWindow(deformation_mm=where, **stress_fields(draws, stress))

    def make_charts(self) -> Mapping[str, Chart]:
        """Return spring against gear, and the shape of the ring."""
        ring, asked = self.source.gear.geometry, self.asked
        panels = balance_panel(self), probability_panel(self)
        modulus = float(np.median(np.asarray(self.source.values["E0"])))
        return {
            "design": Chart(panels=panels),
            "profile": ring_chart(ring, modulus, asked.middle_mm),
        }

    @property
    def _reference(self) -> int:
        """Place of the temperature that is nearest to the reference."""
        levels = np.asarray(self.asked.temperature_C)
        return int(np.argmin(np.abs(levels - self.source.gear.reference_temperature)))

    def _intervals(self, forces: np.ndarray) -> np.ndarray:
        """Return the set points that keep each gear in the window [mm], (2, draw)."""
        return set_points(self.chosen.rate, self.asked.sizes_mm, forces)
