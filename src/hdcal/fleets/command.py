"""`hdcal fleet`: many gears of one kind."""

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
    help="Predict the force of future gears at this deformation [mm] or angle [rad].",
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
def fleet(console: Console, out, force, scheduler, gears, skip_bad, **given):
    """Compare the gears in DATA: stiffness, scatter, outliers.

    DATA has a column `specimen`, gear or serial, or is a folder with a file, or a
    folder of data.csv and gear.toml, for each gear.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.measurements.gear_files import gear_files
    from hdcal.data.plausible import implausible
    from hdcal.data.tables.parquet_files import is_parquet
    from hdcal.fleets.next_gear import force_findings
    from hdcal.fleets.reading.read_fleet import read_fleet, usable
    from hdcal.inference.posterior_file import FILE_NAME, FLEET, content
    from hdcal.report.table_files import frame_parquet

    names = "deformation", "limit_force", "force_tolerance"
    request = {name: given.pop(name) for name in names}
    seed, readings = given.pop("seed"), None
    with console.wrong as wrong:
        wrong += implausible("seed", seed)
        wrong += implausible("force_tolerance", request["force_tolerance"])
        if gear_files(given["data"]) or is_parquet(given["data"]):
            outside = ["sheet", "specimen"]
            wrong += options.without_meaning(outside, "a folder of gears")
        if given["columns"] is not None:  # The console has that finding already.
            readings = wrong.attempt(read_fleet, scheduler=scheduler, **given)
        if readings is not None:
            out = f"{readings.case.name}-fleet" if out is None else out
            readings = wrong.attempt(usable, readings, gears, skip_bad=skip_bad)
        if readings is not None:
            force_request = {name: request[name] for name in names[:2]}
            wrong += unit_findings(readings.case.units, **force_request)
            wrong += force_findings(readings, **force_request)
        console.reserve_folder(out, force)
    assert readings is not None
    from hdcal.fleets.fleet import fleet_of
    from hdcal.fleets.model.population import Sampling, fit_population

    with progress_bar() as progress:
        fit = fit_population(readings, Sampling(seed=seed, progress=progress))
        result = fleet_of(readings, fit, **request)
    table, tree = result.to_frame(), result.to_datatree()
    others = {FILE_NAME: lambda: content(tree, FLEET, {"status": result.status})}
    if (parquet := frame_parquet(table)) is not None:
        others["gears.parquet"] = lambda: parquet
    return console.show(result, tables={"gears.csv": table}, others=others)
