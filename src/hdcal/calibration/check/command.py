"""`hdcal check`: read and validate, compute nothing."""

from functools import partial

import click

from hdcal.calibration.check.gears import read_whole
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import case_options, force_option, json_option
from hdcal.errors import Finding, InputError

# By these letters --force knows an older gear file, and an older picture.
_GEAR, _PNG, _SVG = b"[gear]\n", b"\x89PNG", b"<?xml"


@command(short_help="Read DATA only, and say what was understood.")
@case_options
@click.option("--effects", is_flag=True, help="List what each effect lacks, too.")
@click.option(
    "--write-gear",
    metavar="GEAR.toml",
    help="Without a gear file: write one there, with what was understood of DATA.",
)
@click.option(
    "--plot",
    metavar="FILE.png",
    help="Draw the readings there (.png or .svg).",
)
@force_option
@json_option
@click.pass_obj
def check(console: Console, effects, write_gear, plot, force, **given):
    """Read DATA and its gear file, and say what was understood.

    DATA may be a folder with a file, or a folder, for each gear too.
    """
    from hdcal.data.reading import UNSIZED
    from hdcal.report.saving import Target

    with console.wrong:
        case = read_whole(console, given)
        if write_gear and case is not None and UNSIZED not in case.notes:
            words = "writes a gear file where there is none, and one was read here"
            raise InputError([Finding("write_gear", words, "Edit that one")])
        if plot is not None and not plot.lower().endswith((".png", ".svg")):
            words = f"'{plot}' ends in neither .png nor .svg"
            raise InputError([Finding("plot", words, "Name such a file")])
        beginning = _SVG if str(plot).lower().endswith(".svg") else _PNG
        asked = {write_gear: _GEAR, plot: beginning}
        places = {}
        for name, text in asked.items():
            if name is not None:
                reserve = partial(Target, name, force, beginning=text)
                places[name] = console.hold(reserve)
    assert case is not None
    from hdcal.calibration.check.document import check_document
    from hdcal.calibration.check.summary import check_answer, gear_file

    found = check_answer(case)
    code = console.answer(check_document(found, lacking=effects), found)
    if write_gear:
        with places[write_gear].filled() as path:
            path.write_text(gear_file(case), "utf-8")
        console.words(f"the gear file: {write_gear}. Add what it does not know yet")
    if plot:
        from hdcal.calibration.check.figure import readings_figure
        from hdcal.report.canvas import render

        kind = "svg" if beginning == _SVG else "png"
        with places[plot].filled() as path:
            path.write_bytes(render(readings_figure(case), kind, case.name))
        console.words(f"the picture: {plot}")
    return code
