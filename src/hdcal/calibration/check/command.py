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

# How files begin that --force may replace.
_GEAR, _PICTURES = b"[gear]\n", {"png": b"\x89PNG", "svg": b"<?xml"}


@command(short_help="Read and check DATA without computing.")
@case_options
@click.option(
    "--effects", is_flag=True, help="List what the data lack for each effect."
)
@click.option(
    "--write-gear",
    metavar="GEAR.toml",
    help="Write a gear file, if there is none, with what is known from DATA.",
)
@click.option(
    "--plot",
    metavar="FILE.png",
    help="Draw the readings to FILE (.png or .svg).",
)
@force_option
@json_option
@click.pass_obj
def check(console: Console, effects, write_gear, plot, force, **given):
    """Read DATA and its gear file, and report what was read.

    DATA may also be a folder with a file, or a folder, for each gear.
    """
    from hdcal.data.reading import UNSIZED
    from hdcal.report.saving import Target

    kind = "svg" if str(plot).lower().endswith(".svg") else "png"
    places = {}
    with console.wrong:
        case = _read(console, given)
        if write_gear and case is not None and UNSIZED not in case.notes:
            words = "writes a gear file where there is none, and one was read here"
            raise InputError([Finding("write_gear", words, "Edit that one")])
        if plot is not None and not plot.lower().endswith((".png", ".svg")):
            words = f"'{plot}' ends in neither .png nor .svg"
            raise InputError([Finding("plot", words, "Name such a file")])
        for name, beginning in ((write_gear, _GEAR), (plot, _PICTURES[kind])):
            if name is not None:
                reserve = partial(Target, name, force, beginning=beginning)
                places[name] = console.hold(reserve)
    assert case is not None
    from hdcal.calibration.check.check import check as check_case

    found = check_case(case, each_effect=effects)
    code = console.show(found)
    if write_gear:
        with places[write_gear].filled() as path:
            path.write_text(_gear_file(case), "utf-8")
        console.words(f"the gear file: {write_gear}. Complete it")
    if plot:
        from hdcal.report.charts.chart_drawing import images

        (picture,) = images(found.charts()["readings"], case.name, [kind]).values()
        with places[plot].filled() as path:
            path.write_bytes(picture)
        console.words(f"the picture: {plot}")
    return code


def _gear_file(case: "Case") -> str:
    """Return a gear file for readings that came without one."""
    from hdcal.data.gear_file.gear_text import gear_text

    # Whether they are radial or diametral is unknown, so it is left out.
    measured = {"reference_temperature_C": case.gear.reference_temperature}
    named = {"name": case.name, "theory": case.gear.theory}
    return gear_text(named, measured, case.columns)


def _read(console: Console, given: dict[str, Any]) -> "Case | None":
    """Read a case, or a folder with a file for each gear as one case.

    Args:
        console: of the command; it collects the findings.
        given: values of `case_options`.
    """
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
