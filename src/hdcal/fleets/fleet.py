"""Many gears of one kind: each one, the population they come from, the next one."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hdcal.data.case import Case
from hdcal.data.plausible import implausible
from hdcal.errors import Findings
from hdcal.fleets.each_gear import each_gear
from hdcal.fleets.fleet_posterior import FleetPosterior
from hdcal.fleets.fleet_problem import fleet_problem, rough_values
from hdcal.fleets.groups import groups
from hdcal.fleets.misfit import Misfit, misfit
from hdcal.fleets.next_force import NextForce
from hdcal.fleets.next_gear import next_gear
from hdcal.fleets.off_in import called_off
from hdcal.fleets.own_shapes import own_shapes
from hdcal.fleets.read_fleet import read_fleet
from hdcal.fleets.readings import FleetReadings
from hdcal.fleets.sampling import sample_population
from hdcal.fleets.usable import usable
from hdcal.inference.checks import Check
from hdcal.inference.sample import Progress, check_settings
from hdcal.notebook import Shown
from hdcal.report.plain import as_plain

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, repr=False)
class Fleet(Shown):
    """What is known of gears that were measured alike.

    Attributes:
        readings: of all of them, at the sizes of the gear file.
        draws: of the population by site, shape (d,): stiffness [N/mm as read],
            specimen_sd (relative), zero and run_offset_sd [N], sigma [N], noise_spread,
            off_share and off_ratio; where they are told lot_sd and rig_sd (relative)
            and operator_sd [N], and how far each lies from the mean of all, lot_1, …
            and rig_1, … (relative) and operator_1, … [N].
        stiffness: of each gear, of as many draws, had it the gear file's sizes, shape
            (t, g) [N/mm as read].
        apart: of each gear from the centre of its lot, likewise, as a share of it.
        size_ratio: of each gear, by which its own sizes make it stiffer, shape (g,).
        noise_sd: of each gear, beside loop and bend where they are clear, shape (g,)
            [N].
        own_noise_sd: likewise, by its own line and drawn towards no other gear.
        zero: of each gear in the mean of its mountings, shape (g,) [N].
        distance: of each gear from the centre in ordinary gears' sds, shape (g,).
        off: probability of each gear that it is no ordinary one, shape (g,).
        loop: of each gear, of loading above unloading; NaN where no reading tells it,
            shape (g,) [N].
        bend: of each gear, of the middle of its curve under the ends; likewise [N].
        chances: of stiffness, noise, zero and shape that an ordinary gear is as far
            out in it, shape (g,) each.
        off_in: of stiffness, noise, zero and shape which gears are called off in it.
        next_stiffness: of a gear not yet measured, shape (d,) [N/mm as read].
        unit: stiffness at K = 1 [N/mm as read].
        lots: their names, in the order of lot_1, … of the draws; empty where none are
            told apart.
        operators: likewise of operator_1, ….
        rigs: likewise of rig_1, ….
        misfit: what the readings have beside straight lines.
        force_tolerance: width that a force may lie in [N]; None where none is stated.
        checks: of the sampler.
        settings: of the run.
    """

    readings: FleetReadings
    draws: Mapping[str, np.ndarray]
    stiffness: np.ndarray
    apart: np.ndarray
    size_ratio: np.ndarray
    noise_sd: np.ndarray
    own_noise_sd: np.ndarray
    zero: np.ndarray
    distance: np.ndarray
    off: np.ndarray
    loop: np.ndarray
    bend: np.ndarray
    chances: Mapping[str, np.ndarray]
    off_in: Mapping[str, np.ndarray]
    next_stiffness: np.ndarray
    unit: float
    lots: Sequence[str]
    operators: Sequence[str]
    rigs: Sequence[str]
    misfit: Misfit
    force_tolerance: float | None
    checks: tuple[Check, ...]
    settings: Mapping[str, object] = field(default_factory=dict)

    @property
    def case(self) -> Case:
        """Their gears, runs and notes."""
        return self.readings.case

    @property
    def rows(self) -> np.ndarray:
        """Readings of each gear, shape (g,)."""
        sums = self.readings.sums
        return np.bincount(sums.gear, sums.rows).astype(int)

    @property
    def mountings(self) -> np.ndarray:
        """Mountings of each gear, shape (g,)."""
        return np.bincount(self.readings.sums.gear)

    @property
    def called(self) -> np.ndarray:
        """Which gears are called off, in whatever, shape (g,)."""
        return np.any(list(self.off_in.values()), axis=0)

    @property
    def at_one_size(self) -> bool:
        """Whether gears of several sizes were compared at the gear file's."""
        return bool(np.any(self.size_ratio != 1.0))

    @cached_property
    def posterior(self) -> FleetPosterior:
        """The population alone, as it is saved."""
        return FleetPosterior.of(self)

    @property
    def tree(self) -> "xr.DataTree":
        """Draws of the population in ArviZ' groups."""
        return self.posterior.tree

    def next_force(
        self, deformation: float, limit_force: float | None = None, **how: Any
    ) -> NextForce:
        """Return the force that a gear to come needs, as its posterior tells it.

        Args:
            deformation: as read, with the sign of the data [mm].
            limit_force: a capacity, its size [N].
            how: content and confidence, as `FleetPosterior.next_force` takes them.
        """
        return self.posterior.next_force(deformation, limit_force, **how)

    def summary(self) -> dict:
        """Return all that is told of them as plain data, as in summary.json."""
        # Late: words and intervals take what a fleet is made of.
        from hdcal.fleets.summary import fleet_answer

        return as_plain(fleet_answer(self))

    @property
    def reasons(self) -> tuple[str, ...]:
        """Return why the result must not be used; empty where it may."""
        return tuple(c.words for c in self.checks if c.outcome == "failed")


def fleet(
    data: Any,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    chains: int = 4,
    warmup: int = 500,
    draws: int = 800,
    seed: int = 0,
    force_tolerance: float | None = None,
    gears: Any = None,
    since: str | None = None,
    scheduler: str | None = None,
    skip_bad: bool = False,
    progress: Progress | None = None,
) -> Fleet:
    """Say of many gears how stiff each one is, and which ones are off.

    A straight line for each mounting: stiffness of its gear, zero of its own, noise
    that is independent from reading to reading. Gears scatter about the centre of their
    population, most as ordinary ones, some farther.

    Args:
        data: a case from `read_case`, whose rows name their specimen; or a file or a
            table in memory as that takes it; or a folder with a file, or a folder of
            data.csv and gear.toml, for each gear; or a Parquet file or a folder of
            them, partitioned or not, which are read in batches.
        gear: as in `read_case`, where no case is given.
        columns: likewise.
        chains: independent chains, two or more.
        warmup: iterations of adaptation per chain, where NUTS draws: independent
            proposals, which are tried first, need none.
        draws: draws kept per chain.
        seed: of all random numbers; the same seed gives the same answer.
        force_tolerance: width that the force at the largest deformation may lie in [N].
        gears: table of the sizes of each gear, where they differ: a file or a table in
            memory with a column specimen and columns such as wall_thickness_mm.
        since: day, as 2026-09-01, before which what was read is left out.
        scheduler: address of a Dask scheduler, whose workers read the files of a
            Parquet folder; they have to find them under the same names.
        skip_bad: leave out gears of which a row cannot be read, the size is missing, or
            nothing says how stiff they are: whole, and named in the notes.
        progress: called with (iterations done, iterations in all).

    Raises:
        InputError: there are too few gears, one is bad and may not be left out, or none
            scatters about its line.
    """
    began = time.perf_counter()
    check_settings(chains, warmup, draws, seed)
    with Findings() as wrong:
        wrong += implausible("force_tolerance", force_tolerance)
    how: dict = {"scheduler": scheduler, "skip_bad": skip_bad}
    readings = read_fleet(data, gear, columns=columns, **how)
    if since is not None:
        readings = readings.since(since)
    readings, ratio = usable(readings, gears, skip_bad=skip_bad)
    readings = readings.at_one_size(ratio)
    problem, unit = fleet_problem(readings)
    size = {"chains": chains, "warmup": warmup, "draws": draws}
    start = rough_values(problem, readings.sums)
    found = sample_population(problem, start, seed, progress=progress, **size)
    on_one_rig = readings.on_one_rig(found.values)
    shapes = own_shapes(on_one_rig.case)
    about = problem, on_one_rig.sums, found.values
    each = each_gear(*about, seed, shapes.noise_ratio)
    each["chances"]["shape"] = shapes.chance
    return Fleet(
        readings=readings,
        draws=found.values,
        **each,
        size_ratio=ratio,
        loop=shapes.loop,
        bend=shapes.bend,
        off_in=called_off(each["chances"]),
        next_stiffness=next_gear(found.values, np.random.default_rng(seed)),
        unit=unit,
        lots=groups(readings.case.lots)[0],
        operators=groups(readings.case.operators)[0],
        rigs=groups(readings.case.rigs)[0],
        misfit=misfit(on_one_rig.case, each["noise_sd"], shapes.clear),
        force_tolerance=force_tolerance,
        checks=found.checks,
        settings={
            "seed": seed,
            **size,
            "sampler": found.sampler,
            "seconds": time.perf_counter() - began,
        },
    )
