"""`hdcal causes`: effects that many gears have in common."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    folder_options,
    json_option,
    library_option,
    seed_option,
    skip_bad_option,
    without_meaning,
)


@command(short_help="Find the effects of many gears, and their frequency.")
@case_options
@library_option
@click.option(
    "--jobs",
    default=1,
    show_default=True,
    help="Set the number of processes.",
)
@skip_bad_option
@seed_option
@folder_options("Write the result to DIR [default: NAME-causes].")
@json_option
@click.pass_obj
def causes(console: Console, out, force, seed, library, jobs, skip_bad, **given):
    """Find the effects of the gears in DATA, and the frequency of each.

    DATA has a column `specimen`, gear or serial, or is a folder with a file, or a
    folder, for each gear.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.measurements.gear_files import gear_files
    from hdcal.data.plausible import implausible
    from hdcal.diagnosis.library import choose_library
    from hdcal.shared_causes.gears import read_gears, usable_gears

    with console.wrong as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", seed)
        effects = wrong.attempt(choose_library, library)
        if gear_files(given["data"]):
            wrong += without_meaning(["sheet", "specimen"], "a folder of gears")
        readings = usable = None
        if given["columns"] is not None:
            readings = wrong.attempt(read_gears, **given)
        if readings is not None:
            usable = wrong.attempt(usable_gears, readings, skip_bad=skip_bad)
            out = f"{readings.case.name}-causes" if out is None else out
        console.reserve_folder(out, force)
    assert usable is not None and effects is not None
    from hdcal.shared_causes.causes import causes_of

    asked = {"jobs": jobs, "skip_bad": skip_bad, "seed": seed}
    with progress_bar("weighing") as progress:
        found = causes_of(*usable, effects, progress=progress, **asked)
    return console.show(found, tables={"gears.csv": found.to_frame()})
