"""`hdcal check`: read and validate DATA, and nothing else."""

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    force_option,
    json_option,
    read_given,
    without_meaning,
)
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    from hdcal.data.case import Case

# How pictures begin that --force may replace.
_PICTURES = {"png": b"\x89PNG", "svg": b"<?xml"}


@command(short_help="Read and check DATA without computing.")
@case_options
@click.option(
    "--plot", metavar="FILE.png", help="Write a plot of the readings (.png or .svg)."
)
@force_option
@json_option
@click.pass_obj
def check(console: Console, plot, force, **given):
    """Read DATA and its gear file, and report what was read.

    DATA may also be a folder with a file, or a folder, for each gear.
    """
    from hdcal.calibration.check.check import check as check_case
    from hdcal.report.saving import Target

    kind = "svg" if str(plot).lower().endswith(".svg") else "png"
    place = None
    with console.wrong:
        case = _read(console, given)
        if plot is not None and not plot.lower().endswith(f".{kind}"):
            words = f"'{plot}' ends in neither .png nor .svg"
            raise InputError([Finding("plot", words, "Name such a file")])
        if plot is not None:
            reserve = partial(Target, plot, force, beginning=_PICTURES[kind])
            place = console.hold(reserve)
    assert case is not None
    found = check_case(case)
    code = console.show(found)
    if place is not None:
        from hdcal.report.charts.chart_drawing import images

        (picture,) = images(found.charts()["readings"], case.name, [kind]).values()
        with place.filled() as path:
            path.write_bytes(picture)
        console.words(f"the plot: {plot}")
    return code


def _read(console: Console, given: dict[str, Any]) -> "Case | None":
    """Read a case, or a folder with a file for each gear as one case."""
    from hdcal.data.measurements.folder import read_gear_folder
    from hdcal.data.measurements.gear_files import gear_files

    is_case = given["specimen"] is not None or given["columns"] is None
    if is_case or not gear_files(given["data"]):
        return read_given(console, **given)
    console.wrong += without_meaning(["sheet"], "a folder of gears")
    names = "data", "gear", "columns", "theory", "encoding", "range"
    how = {name: given[name] for name in names}
    found = console.wrong.attempt(read_gear_folder, **how)
    return None if found is None else found[0]
