"""Many gears of one kind: the population, outliers, the next gear."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.measurements.bad_gears import cause
from hdcal.data.plausible import implausible
from hdcal.data.theory_names import SPRING
from hdcal.errors import Findings
from hdcal.fleets.gauge import gauge_rr
from hdcal.fleets.gear_table import GearLeftOut, flagged_gears, gear_table
from hdcal.fleets.model.groups import group_offsets
from hdcal.fleets.model.population import FittedFleet, Sampling, fit_population
from hdcal.fleets.next_gear import force_findings, next_force, next_gear
from hdcal.fleets.over_time import over_time
from hdcal.fleets.reading.read_fleet import read_fleet, usable
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.fleets.result import Fleet, Group, Population
from hdcal.inference.sample import Progress, check_settings
from hdcal.report.item import Interval
from hdcal.versions import versions


def fleet(
    data: Any,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    chains: int = 4,
    warmup: int = 500,
    draws: int = 800,
    seed: int = 0,
    deformation: float | None = None,
    limit_force: float | None = None,
    force_tolerance: float | None = None,
    gears: Any = None,
    scheduler: str | None = None,
    skip_bad: bool = False,
    progress: Progress | None = None,
) -> Fleet:
    """Compare many gears of one kind: scatter, outliers, future gears.

    Args:
        data: a case, file or table as `read_case` takes it, with a column specimen; a
            folder with a file, or a folder of data.csv and gear.toml, for each gear; a
            Parquet file or a folder of them, which are read in batches.
        gear: as in `read_case`, as are the columns.
        columns: by quantity.
        chains: independent chains, two or more.
        warmup: iterations of adaptation per chain, where NUTS draws.
        draws: kept per chain.
        seed: of all random numbers.
        deformation: as read, at which the force of future gears is predicted [mm].
        limit_force: a capacity to compare that force with, its size [N].
        force_tolerance: width within which the force at the largest deformation, or at
            `deformation`, may lie [N].
        gears: file or table of the sizes of each gear, if they differ, with a column
            specimen and columns such as wall_thickness_mm.
        scheduler: address of a Dask scheduler that reads a Parquet folder.
        skip_bad: leave out gears with a fault.
        progress: called with (quantities done, quantities in all).

    Raises:
        InputError: there are too few gears, one is faulty and may not be left out, or
            none scatters about its line.
    """
    check_settings(chains, warmup, draws, seed)
    with Findings() as wrong:
        wrong += implausible("force_tolerance", force_tolerance)
    readings = read_fleet(data, gear, columns=columns, scheduler=scheduler)
    readings = usable(readings, gears, skip_bad=skip_bad)
    with Findings() as wrong:
        wrong += force_findings(readings, deformation, limit_force)
    fit = fit_population(readings, Sampling(chains, warmup, draws, seed, progress))
    return fleet_of(readings, fit, deformation, limit_force, force_tolerance)


def fleet_of(
    readings: FleetReadings,
    fit: FittedFleet,
    deformation: float | None = None,
    limit_force: float | None = None,
    force_tolerance: float | None = None,
) -> Fleet:
    """Return the result of a fitted population; the arguments are those of `fleet`."""
    case, draws, seed = readings.case, fit.draws, int(fit.settings["seed"])
    largest, reasons = readings.largest, fit.failed
    at, force = largest, None
    if deformation is not None:
        at = deformation - readings.contact
    as_read = {"deformation_mm": at + readings.contact}
    if deformation is not None and not reasons:
        how = {"tested": largest, "seed": seed}
        force = next_force(draws, at, limit_force, **how).model_copy(update=as_read)
    table = gear_table(readings, fit)
    flagged = () if reasons else flagged_gears(table)
    odd = [p for gear in flagged for p in gear.quantities.values()]
    left_out = case.left_out.items()
    return Fleet(
        reasons=reasons,
        part="part" if case.gear.theory == SPRING else "gear",
        name=case.name,
        gears=len(table),
        rows=int(readings.sums.rows.sum()),
        left_out=tuple(GearLeftOut(gear=g, why=cause(w)) for g, w in left_out),
        flagged=flagged,
        false_discovery_rate=1.0 - float(np.mean(odd)) if odd else None,
        at_one_size=readings.size_ratio is not None,
        population=_population(fit),
        **_groups(readings, fit),
        next_gear=next_gear(draws, seed),
        next_force=force,
        gauge_rr=gauge_rr(draws, at, force_tolerance).model_copy(update=as_read),
        over_time=() if reasons else over_time(readings, fit),
        seed=seed,
        sampling=dict(fit.settings),
        versions=versions(),
        data_sha256=case.data_sha256,
        units=case.units,
        fit=fit,
        readings=readings,
        gear_table=table,
    )


def _population(fit: FittedFleet) -> Population:
    sites = {
        "stiffness_N_per_mm": "stiffness",
        "gear_sd_percent": "specimen_sd",
        "lot_sd_percent": "lot_sd",
        "rig_sd_percent": "rig_sd",
        "operator_sd_N": "operator_sd",
        "mounting_sd_N": "run_offset_sd",
        "reading_sd_N": "sigma",
        "zero_N": "zero",
        "loop_N": "loop",
        "bend_N": "bend",
    }
    found: dict[str, Any] = dict.fromkeys(sites)
    for name, site in sites.items():
        if site in fit.draws:
            scale = 100.0 if name.endswith("percent") else 1.0
            found[name] = Interval.of(scale * fit.draws[site])
    return Population(**found, correlation=fit.fits.correlation)


def _groups(readings: FleetReadings, fit: FittedFleet) -> dict[str, Any]:
    """Return the lots, operators and rigs that are distinguished."""
    case, draws = readings.case, fit.draws
    lots, operators, rigs = (
        np.asarray(group_offsets(draws, kind)) for kind in ("lot", "operator", "rig")
    )
    lots = draws["stiffness"] * (1.0 + lots)

    def of(kind: str, values: np.ndarray, unit: str) -> tuple[Group, ...]:
        members, names = Counter(getattr(case, kind)), getattr(fit.groups, kind)
        return tuple(
            Group(name=name, members=members[name], value=Interval.of(value), unit=unit)
            for name, value in zip(names, values, strict=False)
        )

    return {
        "lots": of("lots", lots, case.units.stiffness_unit),
        "operators": of("operators", operators, case.units.load_unit),
        "rigs": of("rigs", 100.0 * rigs, "%"),
    }
