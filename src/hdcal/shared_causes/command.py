"""`hdcal causes`: what many gears have in common."""

import click

from hdcal.cli.command import command
from hdcal.cli.compilation_cache import keep_compilations, one_thread_for_algebra
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    folder_options,
    json_option,
    library_option,
    read_given,
    seed_option,
)


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
@seed_option
@folder_options("Result folder [default: NAME-causes].")
@json_option
@click.pass_obj
def causes(console: Console, out, force, library, jobs, scheduler, seed, **given):
    """Say which effects the gears in DATA have, and how often each one is.

    DATA names the gear of each row in a column `specimen`, also called gear or serial.
    """
    one_thread_for_algebra()
    from hdcal.cli.progress import progress_bar
    from hdcal.data.plausible import implausible
    from hdcal.diagnosis.library import choose_library
    from hdcal.physics.registry import EFFECTS

    with console.wrong as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", seed)
        effects = wrong.attempt(choose_library, library, EFFECTS)
        case = read_given(console, **given)
        if case is not None:
            from hdcal.shared_causes.causes import check_gears

            wrong.attempt(check_gears, case)
            out = f"{case.name}-causes" if out is None else out
        console.reserve_folder(out, force)
    assert case is not None and effects is not None
    keep_compilations()
    from hdcal.shared_causes.causes import causes as shared_causes
    from hdcal.shared_causes.summary import causes_report

    how = {"jobs": jobs, "scheduler": scheduler, "seed": seed}
    with progress_bar("weighing") as progress:
        found = shared_causes(case, library=effects, progress=progress, **how)
    return console.report(causes_report(found, console.command))
