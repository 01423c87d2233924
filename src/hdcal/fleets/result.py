"""A fleet as a result: population, outliers, and future gears."""

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd
from pydantic import Field, InstanceOf, computed_field

from hdcal.data.measurements.bad_gears import left_out_words
from hdcal.fleets.charts import curves_chart, gears_chart, time_chart
from hdcal.fleets.gauge import GaugeRR
from hdcal.fleets.gear_table import Flagged, GearLeftOut, ranked
from hdcal.fleets.model.gear_quantity import MOST_FALSE
from hdcal.fleets.model.population import FittedFleet
from hdcal.fleets.model.quantities import population_priors
from hdcal.fleets.next_gear import NextForce, NextGear, stiffness_of_gears
from hdcal.fleets.over_time import Change
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.inference.posterior_tree import dataset
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
_IN_NEWTONS = ("zero", "run_offset_sd", "sigma", "loop", "bend", "operator")
# Gears in the table of a terminal, and of a page; gears.csv has all of them.
_LISTED, _MOST_LISTED = 25, 2000


class Population(Item):
    """Population of the ordinary gears, per mm as read; 95 % credible intervals.

    The loop is the force of loading above unloading, the bend how far the middle of the
    curve lies below its chord.
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
    """Stiffness of a lot; zero of an operator or gain of a rig, less the mean.

    Members are the gears of a lot, or mountings.
    """

    name: Words
    members: Count
    value: Interval
    unit: str


class Fleet(Result):
    """Gears of one kind: their population, and the outliers.

    Attributes:
        flagged: gears that are outliers with a probability of `least_probability_off`
            or more, those in their stiffness first.
        at_one_size: True if readings were converted to the sizes of the gear file. All
            numbers except gears.csv then refer to those sizes.
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

    @property
    def draws(self) -> Mapping[str, np.ndarray]:
        """Draws of the population by site, shape (d,)."""
        return self.fit.draws

    def to_frame(self) -> pd.DataFrame:
        """Return the table of gears.csv."""
        table = self.gear_table
        if self.left_out:
            rows = pd.DataFrame(
                {"gear": out.gear, "status": f"left out: {out.why}"}
                for out in self.left_out
            )
            whole = {"rows": "Int64", "runs": "Int64", "flagged": "boolean"}
            table = pd.concat([table.astype(whole), rows], ignore_index=True)
        return table.rename(columns=self.units.key)

    def to_datatree(self) -> "xr.DataTree":
        """Return draws of the population and of future gears, in groups of ArviZ."""
        import xarray as xr

        fit, chains = self.fit, int(self.fit.settings["chains"])
        draws = {site: values.reshape(chains, -1) for site, values in fit.draws.items()}
        units = {site: self.units.unit(_unit(site)) for site in draws}
        population = dataset(draws, units=units)
        for kind in ("lot", "operator", "rig"):
            for place, label in enumerate(getattr(fit.groups, f"{kind}s"), 1):
                population[f"{kind}_{place}"].attrs["long_name"] = label
        gears = stiffness_of_gears(fit.draws).sample(self.seed).reshape(chains, -1)
        groups = {"predictions": dataset({"stiffness": gears}, units=units)}
        return xr.DataTree.from_dict({"posterior": population} | groups)

    def make_charts(self) -> Mapping[str, Chart]:
        """Return the gears, their readings, and changes with the date."""
        charts = {"gears": gears_chart(self), "curves": curves_chart(self)}
        return charts | ({"time": time_chart(self)} if self.over_time else {})

    # What the template needs.

    def ranked(self, on_page: bool) -> list[dict[str, Any]]:
        """Return rows of the table: flagged gears first, then the least ordinary."""
        most = _MOST_LISTED if on_page else _LISTED
        return ranked(self.gear_table).head(most).to_dict("records")

    @property
    def scatter(self) -> list[tuple[str, Interval | None, str, float]]:
        """Sources of scatter, their sd with its unit, and the force of one unit [N]."""
        population, unit = self.population, self.units.load_unit
        force = population.stiffness_N_per_mm.median
        force *= abs(self.gauge_rr.deformation_mm - self.readings.contact)
        sources = (
            ("lots", population.lot_sd_percent, "%", 0.01 * force),
            (f"{self.part}s", population.gear_sd_percent, "%", 0.01 * force),
            ("gains of rigs", population.rig_sd_percent, "%", 0.01 * force),
            ("zeros of operators", population.operator_sd_N, unit, 1.0),
            ("zeros of mountings", population.mounting_sd_N, unit, 1.0),
            ("single readings", population.reading_sd_N, unit, 1.0),
        )
        return [source for source in sources if source[1] is not None]

    @property
    def from_theory(self) -> tuple[float, float] | None:
        """Stiffness over that of the theory, and the latter, if they are far apart."""
        expected = population_priors(self.readings.case)[1]["stiffness"]
        middle, log_sd = map(float, expected.numbers)
        ratio = self.population.stiffness_N_per_mm.median / middle
        far = self.part == "gear" and abs(np.log(ratio)) > _FAR * log_sd
        return (ratio, middle) if far else None

    @property
    def groups(self) -> dict[str, tuple[int, int]]:
        """Numbers of labels and of distinguished groups by kind."""
        case, kinds = self.readings.case, ("lots", "operators", "rigs")
        return {
            kind: (len({*getattr(case, kind)}), len(getattr(self, kind)))
            for kind in kinds
        }


def _unit(site: str) -> str:
    """Return the unit of a site, in N and mm."""
    if site == "stiffness":
        return "N/mm"
    share = site.endswith(("_share", "_ratio")) or site == "noise_spread"
    return "N" if site.startswith(_IN_NEWTONS) and not share else "1"
