"""`hdcal fleet`: many gears of one kind, and which of them are off."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE, LENGTH, unit_findings
from hdcal.cli.options import (
    case_options,
    folder_options,
    json_option,
    read_given,
    seed_option,
    skip_bad_option,
    without_meaning,
)
from hdcal.errors import Finding


@command(short_help="Many gears: which one is off, and how much do they scatter?")
@case_options
@click.option(
    "--deformation",
    type=LENGTH,
    help="Deformation as read at which the force of gears to come is asked for [mm].",
)
@click.option(
    "--limit-force", type=FORCE, help="Capacity to compare that force with [N]."
)
@click.option(
    "--force-tolerance",
    type=FORCE,
    help="Width within which the force at the largest deformation may lie [N].",
)
@click.option(
    "--gears",
    metavar="TABLE",
    help="Table of the sizes of each gear, where they differ.",
)
@click.option(
    "--since",
    metavar="DAY",
    help="Leave out what was read before a day, as 2026-09-01.",
)
@skip_bad_option
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Dask scheduler whose workers read the files of a Parquet folder.",
)
@seed_option
@folder_options("Result folder [default: NAME-fleet].")
@json_option
@click.pass_obj
def fleet(
    console: Console,
    out,
    force,
    seed,
    deformation,
    limit_force,
    force_tolerance,
    gears,
    scheduler,
    since,
    skip_bad,
    **given,
):
    """Say of the gears in DATA how stiff each one is, and which ones are off.

    DATA names the gear of each row in a column `specimen`, also called gear or serial;
    or it is a folder with a file for each gear, or with a folder of data.csv and
    gear.toml for each.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.plausible import implausible

    with console.wrong as wrong:
        wrong += implausible("seed", seed)
        wrong += implausible("force_tolerance", force_tolerance)
        wrong += implausible("limit_force", limit_force, "sigma")
        if limit_force is not None and deformation is None:
            remedy = "Say --deformation, at which that force is needed"
            wrong.append(Finding("limit_force", "has no deformation", remedy))
        readings = read_gears(console, scheduler, given | {"skip_bad": skip_bad})
        if readings is not None and since is not None:
            readings = wrong.attempt(readings.since, since)
        if readings is not None:
            from hdcal.fleets.next_force import deformation_findings
            from hdcal.fleets.usable import usable

            kept = wrong.attempt(usable, readings, gears, skip_bad=skip_bad)
            if kept is not None and deformation is not None:
                tested, case = kept[0].largest, kept[0].case
                about = tested, case.gear.reach, case.units
                given = {"deformation": deformation, "limit_force": limit_force}
                wrong += unit_findings(case.units, **given)
                wrong += deformation_findings(deformation, *about)
            out = f"{readings.case.name}-fleet" if out is None else out
        console.reserve_folder(out, force)
    assert readings is not None
    asked = {"seed": seed, "force_tolerance": force_tolerance}
    asked |= {"gears": gears, "skip_bad": skip_bad}
    from hdcal.fleets.fleet import fleet as fit_fleet
    from hdcal.fleets.summary import fleet_report

    with progress_bar() as progress:
        found = fit_fleet(readings, progress=progress, **asked)
    needed = None
    if deformation is not None and not found.reasons:
        needed = found.next_force(deformation, limit_force)
    return console.report(fleet_report(found, console.command, needed))


def read_gears(console: Console, scheduler: str | None, given: dict):
    """Return what was measured; Parquet is read in batches, whatever its size."""
    from hdcal.data.measurements.gear_files import gear_files
    from hdcal.data.tables.parquet_files import is_parquet
    from hdcal.fleets.read_fleet import read_fleet

    several = bool(gear_files(given["data"]))
    if (several or is_parquet(given["data"])) and given["columns"] is not None:
        names = "data", "gear", "columns", "theory", "reading", "encoding", "skip_bad"
        names += ("range",)
        console.wrong += without_meaning(["sheet", "specimen"], "a folder of gears")
        how: dict = {name: given[name] for name in names}
        return console.wrong.attempt(read_fleet, **how, scheduler=scheduler)
    case = read_given(console, **given)
    if case is None:
        return None
    return console.wrong.attempt(read_fleet, case, scheduler=scheduler)
