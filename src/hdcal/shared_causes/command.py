"""`hdcal causes`: what many gears have in common."""

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
)
from hdcal.fleets.command import read_gears


@command(short_help="Many gears: which effects they have, and how often each one is.")
@case_options
@library_option
@click.option(
    "--jobs", default=1, show_default=True, help="Processes to share the gears."
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Dask scheduler whose workers weigh the gears instead.",
)
@skip_bad_option
@seed_option
@folder_options("Result folder [default: NAME-causes].")
@json_option
@click.pass_obj
def causes(
    console: Console, out, force, seed, library, jobs, scheduler, skip_bad, **given
):
    """Say which effects the gears in DATA have, and how often each one is.

    DATA names the gear of each row in a column `specimen`, also called gear or serial.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.plausible import implausible
    from hdcal.diagnosis.library import choose_library
    from hdcal.physics.registry import EFFECTS

    with console.wrong as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", seed)
        effects = wrong.attempt(choose_library, library, EFFECTS)
        readings = read_gears(console, None, given)
        if readings is not None:
            from hdcal.shared_causes.causes import usable_gears

            wrong.attempt(usable_gears, readings, skip_bad=skip_bad)
            out = f"{readings.case.name}-causes" if out is None else out
        console.reserve_folder(out, force)
    assert readings is not None and effects is not None
    from hdcal.shared_causes.causes import causes as shared_causes

    with progress_bar("weighing") as progress:
        found = shared_causes(
            readings,
            library=effects,
            jobs=jobs,
            scheduler=scheduler,
            skip_bad=skip_bad,
            seed=seed,
            progress=progress,
        )
    return console.show(found, tables={"gears.csv": found.to_frame()})
