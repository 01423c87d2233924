"""`hdcal fleet`: many gears of one kind; `hdcal margin`: of these, or of one gear."""

from typing import Any

import click

from hdcal.cli import options
from hdcal.cli.command import Command, command
from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE, LENGTH, unit_findings
from hdcal.prediction.margin.command import margin as of_models

# Options without a meaning for a fleet: its lines are the same in both directions, and
# gears to come are those of its population, at the reference temperature.
_OTHERS = ("quantity", "population", "direction", "temperature", "given_force", "seed")
_OTHERS += ("tolerances", "rule", "certificate")


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
    from hdcal.data.plausible import implausible
    from hdcal.fleets.next_gear import force_findings
    from hdcal.fleets.reading.read_fleet import usable
    from hdcal.inference.posterior_file import FILE_NAME
    from hdcal.report.table_files import frame_parquet

    names = "seed", "deformation", "limit_force", "force_tolerance"
    asked = {name: given.pop(name) for name in names}
    with console.wrong as wrong:
        wrong += implausible("seed", asked["seed"])
        wrong += implausible("force_tolerance", asked["force_tolerance"])
        readings = read_gears(console, scheduler, given)
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
    from hdcal.fleets.fleet import fleet_of
    from hdcal.fleets.model.population import fit_population
    from hdcal.fleets.model.sampling import Sampling

    with progress_bar() as progress:
        sampling = Sampling(seed=asked.pop("seed"), progress=progress)
        found = fleet_of(readings, fit_population(readings, sampling), **asked)
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


@click.pass_context
def _margin(context: click.Context, run: str, **asked):
    from hdcal.inference.posterior_file import FLEET, kind_of

    if kind_of(run) is FLEET:
        return _of_fleet(context.obj, run, **asked)
    assert of_models.callback is not None
    return context.invoke(of_models.callback, run=run, **asked)


def _of_fleet(console: Console, run: str, out, force, deformation, **asked):
    from hdcal.fleets.posterior import FleetPosterior

    found = None
    with console.wrong as wrong:
        posterior = wrong.attempt(FleetPosterior.load, run)
        console.reserve_folder(out, force)
        wrong += options.without_meaning(_OTHERS, "the result of a fleet")
        if posterior is not None:
            shares = {"confidence": asked["confidence"]}
            if options.is_given("content"):
                shares["content"] = asked["content"]
            limit, units = asked["limit_force"], posterior.units
            wrong += unit_findings(units, deformation=deformation, limit_force=limit)
            # A text that is no number was refused while the options were read.
            if deformation is not None:
                found = wrong.attempt(posterior.margin, deformation, limit, **shares)
    assert found is not None
    return console.show(found, answer="margin.json")


margin = Command(
    "margin",
    callback=_margin,
    params=of_models.params,
    help=of_models.help,
    short_help=of_models.short_help,
    context_settings=of_models.context_settings,
)
