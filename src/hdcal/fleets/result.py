"""A fleet as a result: population, odd gears, and gears to come."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field, InstanceOf, computed_field

from hdcal.data.measurements.bad_gears import left_out_words
from hdcal.data.tables.cells import NOT_STATED
from hdcal.fleets.charts import curves_chart, gears_chart, time_chart
from hdcal.fleets.gauge import GaugeRR
from hdcal.fleets.gear_table import Flagged, GearLeftOut, with_left_out
from hdcal.fleets.model.gear_quantity import MOST_FALSE
from hdcal.fleets.model.groups import rigs_are_linked
from hdcal.fleets.model.population import FittedFleet
from hdcal.fleets.model.quantities import population_priors
from hdcal.fleets.next_gear import NextForce, NextGear
from hdcal.fleets.over_time import Change
from hdcal.fleets.posterior import FleetMargin, FleetPosterior
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.report.charts.chart_spec import Chart
from hdcal.report.item import (
    INTERVAL,
    Count,
    Digest,
    Interval,
    Item,
    Probability,
    Words,
    quantity,
)
from hdcal.report.result import Result

if TYPE_CHECKING:
    import xarray as xr

# A stiffness so many prior sds from that of the theory is reported.
_FAR = 3.0
# Gears in the table of a terminal, and of a page; gears.csv has all of them.
_LISTED, _MOST_LISTED = 25, 2000


class Population(Item):
    """Population of the ordinary gears, per mm as read; 95 % credible intervals.

    Lots, rigs and operators have an sd if they are distinguished. The loop is the force
    of loading above unloading, the bend how far the middle of the curve lies below its
    chord.
    """

    stiffness_N_per_mm: Interval = quantity("stiffness of the centre", "N/mm")
    gear_sd_percent: Interval = quantity("sd between gears", "%")
    lot_sd_percent: Interval | None = quantity("sd between lots", "%")
    rig_sd_percent: Interval | None = quantity("sd of gains between rigs", "%")
    operator_sd_N: Interval | None = quantity("sd of zeros between operators", "N")
    mounting_sd_N: Interval = quantity("sd of zeros between mountings", "N")
    reading_sd_N: Interval = quantity("noise of a reading", "N")
    zero_N: Interval = quantity("zero", "N")
    loop_N: Interval | None = quantity("loop", "N")
    bend_N: Interval | None = quantity("bend", "N")
    correlation: float = quantity("correlation of neighbouring readings")


class Group(Item):
    """A lot, an operator or a rig; 95 % credible intervals.

    Attributes:
        members: gears of a lot, or mountings.
        value: stiffness of a lot; zero of an operator or gain of a rig, less the mean.
    """

    name: Words
    members: Count
    value: Interval
    unit: str


class Fleet(Result):
    """Gears of one kind: their population, and the gears that are odd.

    Attributes:
        gears: number of gears, without those left out.
        rows: readings of these.
        flagged: gears that are odd with a probability of `least_probability_off` or
            more, those in their stiffness first.
        false_discovery_rate: expected share of ordinary ones among all that is flagged.
        at_one_size: whether gears of several sizes were compared at the gear file's, to
            which then all numbers but those of gears.csv refer.
        lots: that are distinguished; operators and rigs likewise.
        next_force: of a gear to come, if a deformation was given.
        readings: of all gears, at the sizes of the gear file.
        gear_table: one row a gear, as in gears.csv.
    """

    template = "fleets/report.md.j2"
    table = "flagged"

    format: Literal["hdcal.fleet/2"] = "hdcal.fleet/2"
    name: Words
    gears: Count
    rows: Count
    left_out: tuple[GearLeftOut, ...]
    flagged: tuple[Flagged, ...]
    least_probability_off: Probability = 1.0 - MOST_FALSE
    false_discovery_rate: Probability | None
    interval: float = INTERVAL
    at_one_size: bool
    population: Population
    lots: tuple[Group, ...]
    operators: tuple[Group, ...]
    rigs: tuple[Group, ...]
    next_gear: NextGear
    next_force: NextForce | None
    gauge_rr: GaugeRR
    over_time: tuple[Change, ...]
    seed: Count
    sampling: dict[str, Any]
    versions: dict[str, str]
    data_sha256: Digest
    fit: InstanceOf[FittedFleet] = Field(exclude=True)
    readings: InstanceOf[FleetReadings] = Field(exclude=True)
    gear_table: InstanceOf[pd.DataFrame] = Field(exclude=True)

    @computed_field
    @cached_property
    def notes(self) -> tuple[Words, ...]:
        """What the reader must know, first of the data, then of the model."""
        case = self.readings.case
        out = case.left_out
        left_out = (left_out_words(out, len(out) + self.gears),) if out else ()
        return (*left_out, *self.lines("notes"), *map(self.units.say, case.notes))

    @cached_property
    def posterior(self) -> FleetPosterior:
        """Draws of the population, which posterior.nc holds."""
        return FleetPosterior.of(self)

    @property
    def draws(self) -> Mapping[str, np.ndarray]:
        """Draws of the population by site, shape (d,)."""
        return self.fit.draws

    def margin(
        self, deformation: float, limit_force: float | None = None, **shares: float
    ) -> FleetMargin:
        """Return the force of gears to come, as `FleetPosterior.margin` does."""
        return self.posterior.margin(deformation, limit_force, **shares)

    def to_frame(self) -> pd.DataFrame:
        """Return the table of gears.csv."""
        whole = with_left_out(self.gear_table, self.left_out)
        return whole.rename(columns=self.units.key)

    def to_datatree(self) -> "xr.DataTree":
        """Return the draws of the population in the groups of ArviZ."""
        return self.posterior.tree

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the gears, their readings, and changes with the date."""
        charts = {"gears": gears_chart(self), "curves": curves_chart(self)}
        return charts | ({"time": time_chart(self)} if self.over_time else {})

    # What the template needs.

    def ranked(self, on_page: bool) -> list[dict[str, Any]]:
        """Return rows of the table: flagged gears first, then the least ordinary."""
        most = _MOST_LISTED if on_page else _LISTED
        order = ["flagged", "probability_off"]
        table = self.gear_table.sort_values(order, ascending=False, kind="stable")
        return table.head(most).to_dict("records")

    @property
    def scatter(self) -> list[tuple[str, Interval, str, float]]:
        """Sources of scatter, their sd with its unit, and the force of one unit [N]."""
        found, unit = self.population, self.units.load_unit
        force = found.stiffness_N_per_mm.median * abs(self.gauge_rr.deformation_mm)
        sources = (
            ("lots", found.lot_sd_percent, "%", 0.01 * force),
            (f"{self.part}s", found.gear_sd_percent, "%", 0.01 * force),
            ("gains of rigs", found.rig_sd_percent, "%", 0.01 * force),
            ("zeros of operators", found.operator_sd_N, unit, 1.0),
            ("zeros of mountings", found.mounting_sd_N, unit, 1.0),
            ("single readings", found.reading_sd_N, unit, 1.0),
        )
        return [(s, sd, unit, one) for s, sd, unit, one in sources if sd is not None]

    @property
    def alike(self) -> int:
        """Number of gears that are not flagged in their stiffness."""
        return self.gears - sum("stiffness" in one.quantities for one in self.flagged)

    @property
    def from_theory(self) -> tuple[float, float] | None:
        """Stiffness over that of the theory, and the latter, if they are far apart."""
        expected = population_priors(self.readings.case)[1]["stiffness"]
        middle, log_sd = map(float, expected.numbers)
        ratio = self.population.stiffness_N_per_mm.median / middle
        far = self.part == "gear" and abs(np.log(ratio)) > _FAR * log_sd
        return (ratio, middle) if far else None

    @property
    def linked(self) -> bool:
        """Whether gears that several rigs measured compare all of the rigs."""
        return rigs_are_linked(self.readings.sums.gear, self.fit.groups.rig)

    @property
    def groups(self) -> dict[str, tuple[int, int, bool]]:
        """Numbers of labels and of distinguished groups, and whether some lack one."""
        found = {}
        for kind in ("lots", "operators", "rigs"):
            labels = getattr(self.readings.case, kind)
            names = getattr(self.fit.groups, kind)
            found[kind] = len({*labels}), len(names), NOT_STATED in names
        return found
