"""`hdcal check`: read and validate DATA, and nothing else."""

from typing import TYPE_CHECKING, Any

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    json_option,
    out_option,
    read_given,
    without_meaning,
)

if TYPE_CHECKING:
    from hdcal.data.case import Case


@command(short_help="Read and check DATA without computing.")
@case_options
@out_option
@json_option
@click.pass_obj
def check(console: Console, out, force, **given):
    """Read DATA and its gear file, and report what was read.

    DATA may also be a folder with a file, or a folder, for each gear.
    """
    from hdcal.calibration.check.check import check as check_case

    with console.wrong:
        case = _read(console, given)
        console.reserve_folder(out, force)
    assert case is not None
    return console.show(check_case(case), answer="check.json")


def _read(console: Console, given: dict[str, Any]) -> "Case | None":
    """Read a case, or a folder with a file for each gear as one case."""
    from hdcal.data.measurements.folder import read_gear_folder
    from hdcal.data.measurements.gear_files import gear_files

    is_case = given["specimen"] is not None or given["columns"] is None
    if is_case or not gear_files(given["data"]):
        return read_given(console, **given)
    console.wrong += without_meaning(["sheet"], "a folder of gears")
    names = "data", "gear", "columns", "encoding", "range"
    how = {name: given[name] for name in names}
    found = console.wrong.attempt(read_gear_folder, **how)
    return None if found is None else found[0]
