"""`hdcal fleet`: many gears of one kind, and which of them are odd."""

from typing import Any

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE, LENGTH, unit_findings


@command(short_help="Compare many gears: scatter, outliers, the next gear.")
@options.case_options
@click.option(
    "--deformation",
    type=LENGTH,
    help="Predict the force of future gears at this deformation as read [mm].",
)
@click.option(
    "--limit-force", type=FORCE, help="Compare that force with this capacity [N]."
)
@click.option(
    "--force-tolerance",
    type=FORCE,
    help="Set the width of the tolerance of the force for gauge R&R [N].",
)
@click.option(
    "--gears",
    metavar="TABLE",
    help="Read the sizes of each gear from a table, if they differ.",
)
@click.option(
    "--since",
    metavar="DAY",
    help="Leave out readings before this day: 2026-09-01.",
)
@options.skip_bad_option
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Read a Parquet folder on the workers of this Dask scheduler.",
)
@options.seed_option
@options.folder_options("Write the result to DIR [default: NAME-fleet].")
@options.json_option
@click.pass_obj
def fleet(console: Console, out, force, scheduler, since, gears, skip_bad, **given):
    """Compare the gears in DATA: stiffness, scatter, outliers.

    DATA has a column `specimen`, gear or serial, or is a folder with a file, or a
    folder of data.csv and gear.toml, for each gear.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.plausible import implausible
    from hdcal.fleets.next_gear import force_findings
    from hdcal.fleets.reading.usable import usable
    from hdcal.inference.posterior_file import FILE_NAME
    from hdcal.report.table_files import frame_parquet

    names = "seed", "deformation", "limit_force", "force_tolerance"
    asked = {name: given.pop(name) for name in names}
    with console.wrong as wrong:
        wrong += implausible("seed", asked["seed"])
        wrong += implausible("force_tolerance", asked["force_tolerance"])
        readings = read_gears(console, scheduler, given)
        if readings is not None and since is not None:
            readings = wrong.attempt(readings.since, since)
        if readings is not None:
            name = readings.case.name
            readings = wrong.attempt(usable, readings, gears, skip_bad=skip_bad)
            out = f"{name}-fleet" if out is None else out
        if readings is not None:
            case = readings.case
            at, limit = asked["deformation"], asked["limit_force"]
            wrong += unit_findings(case.units, deformation=at, limit_force=limit)
            reach = readings.largest, case.gear.reach, case.units
            wrong += force_findings(at, limit, *reach)
        console.reserve_folder(out, force)
    assert readings is not None
    from hdcal.fleets.fleet import fleet as compared

    with progress_bar() as progress:
        found = compared(readings, progress=progress, **asked)
    table = found.to_frame()
    others = {FILE_NAME: found.posterior.to_netcdf}
    if (parquet := frame_parquet(table)) is not None:
        others["gears.parquet"] = lambda: parquet
    return console.show(found, tables={"gears.csv": table}, others=others)


def read_gears(console: Console, scheduler: str | None, given: dict[str, Any]):
    """Return the readings of DATA; the console collects what is wrong."""
    from hdcal.data.measurements.gear_files import gear_files
    from hdcal.data.tables.parquet_files import is_parquet
    from hdcal.fleets.reading.read_fleet import read_fleet

    if given["columns"] is None:  # The console has that finding already.
        return None
    if gear_files(given["data"]) or is_parquet(given["data"]):
        outside = ["sheet", "specimen"]
        console.wrong += options.without_meaning(outside, "a folder of gears")
    return console.wrong.attempt(read_fleet, scheduler=scheduler, **given)
