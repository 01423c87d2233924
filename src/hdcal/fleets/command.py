"""`hdcal fleet`: many gears of one kind, and which of them are off."""

import click

from hdcal.cli.command import command
from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    folder_options,
    json_option,
    read_given,
    seed_option,
)


@command(short_help="Many gears: which one is off, and how much do they scatter?")
@case_options
@seed_option
@folder_options("Result folder [default: NAME-fleet].")
@json_option
@click.pass_obj
def fleet(console: Console, out, force, seed, **given):
    """Say of the gears in DATA how stiff each one is, and which ones are off.

    DATA names the gear of each row in a column `specimen`, also called gear or serial.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.plausible import implausible

    with console.wrong as wrong:
        wrong += implausible("seed", seed)
        case = read_given(console, **given)
        if case is not None:
            from hdcal.fleets.fleet import check_fleet

            wrong.attempt(check_fleet, case)
            out = f"{case.name}-fleet" if out is None else out
        console.reserve_folder(out, force)
    assert case is not None and out is not None
    keep_compilations()
    from hdcal.fleets.fleet import fleet as fit_fleet
    from hdcal.fleets.summary import fleet_report

    with progress_bar() as progress:
        found = fit_fleet(case, seed=seed, progress=progress)
    return console.report(fleet_report(found, console.command))
