"""`hdcal study`: the force on gears of many sizes, with its bands."""

from functools import partial

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import LENGTH, read_grid, read_named
from hdcal.errors import Finding


def _axes() -> tuple[str, ...]:
    from hdcal.design.study.study import AXES

    return AXES


@command(short_help="Force over sizes and materials, with bands.")
@options.start_options
@options.repeated_option(
    "--vary",
    metavar="NAME=VALUES",
    read=partial(read_named, read=read_grid, known=_axes),
    help="wall_thickness_mm=0.6:0.76:5 or radius_mm=35,40,45; may be repeated. Also "
    "length_mm, load_height_mm, deformation_mm, temperature_C.",
)
@options.material_option("Materials to compare [default: the gear's].")
@click.option("--deformation", type=LENGTH, help="Radial [default: nominal].")
@click.option(
    "--temperature", type=float, metavar="C", help="[default: the reference one]"
)
@options.seed_option
@options.folder_options("Result folder [default: NAME-study].")
@options.json_option
@click.pass_obj
def study(console: Console, run, gear, out, force, **asked):
    """Compute the force for every combination of sizes, from RUN.

    RUN is a folder of `hdcal calibrate`.
    """
    from hdcal.design.sources import open_source
    from hdcal.design.study.study import study as run_study

    with console.wrong as wrong:
        if not (options.is_given("vary") or options.is_given("materials")):
            remedy = "Say --vary wall_thickness_mm=0.6:0.76:5"
            wrong.append(Finding("vary", "nothing is varied", remedy))
        source, usual = open_source(wrong, run, gear, "study")
        target = out or usual
        console.reserve_folder(target, force)
    assert source is not None and target is not None
    found = run_study(source, **asked)
    return console.show(
        found, answer="study.json", tables={"study.csv": found.to_frame()}
    )
