"""`hdcal design` and `hdcal study`."""

from functools import partial
from typing import Any

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import (
    ENDS,
    FORCE,
    LENGTH,
    STRESS,
    Parsed,
    read_ends,
    read_grid,
    read_named,
    read_window,
)
from hdcal.design import AXES, SIZE_NAMES
from hdcal.errors import Finding

# Parameters of one question only.
_OF_WINDOW = ("window", "setting_sd")
_OF_LIMIT = ("limit_force", "limit_stress", "deformation", "vary")


def _open(console: Console, run, out, force, kind: str) -> Any:
    """Return the calibration, and reserve the folder of the result."""
    from hdcal.inference.model_average import load_models

    models = console.wrong.attempt(load_models, run)
    if models is not None:
        console.reserve_folder(out or f"{models.case.name}-{kind}", force)
    return models


@command(short_help="Design a wave generator, or sizes for a limit.")
@click.argument("run", metavar="RUN")
@click.option(
    "--window",
    type=ENDS,
    help="Design a spring that keeps the deformation in this range [mm].",
)
@click.option(
    "--setting-sd",
    type=LENGTH,
    default=0.0,
    help="Set the standard deviation of the set point [mm].",
)
@click.option(
    "--limit-force",
    type=FORCE,
    help="Find sizes that keep the force below this limit [N].",
)
@click.option(
    "--limit-stress",
    type=STRESS,
    help="Keep the stress below this limit [MPa] [default: the yield strength].",
)
@click.option(
    "--deformation",
    type=LENGTH,
    help="Apply the limit at this deformation [mm] [default: nominal].",
)
@options.repeated_option(
    "--vary",
    metavar="SIZE_mm=LO:HI",
    read=partial(read_named, read=read_ends, known=lambda: SIZE_NAMES),
    help="Vary a size in a range: wall_thickness_mm=0.5:0.8. May be repeated.",
)
@click.option(
    "--temperature",
    "temperatures",
    type=Parsed("LO:HI", read_window),
    help="Keep the limits at these temperatures [°C] [default: the reference].",
)
@click.option(
    "--probability",
    default=0.99,
    help="Keep the limits with this probability [default: 0.99].",
)
@options.tolerance_option
@options.seed_option
@options.folder_options("Write the result to DIR [default: NAME-design].")
@options.json_option
@click.pass_obj
def design(console: Console, run, out, force, **given):
    """Design from RUN, a folder of `hdcal calibrate` or `hdcal diagnose`.

    --window finds the softest spring of an elastic wave generator that keeps the
    deformation within the window: below it there is backlash, above it the gear jams.
    --limit-force finds the sizes nearest to the tested ones that keep the limit.
    """
    from hdcal.design.inverse_design import inverse_design
    from hdcal.design.wave_generator import wave_generator

    window, limit = options.is_given("window"), options.is_given("limit_force")
    unused = _OF_LIMIT if window else _OF_WINDOW
    with console.wrong as wrong:
        if window == limit:
            words = "both are given" if window else "neither is given"
            remedy = "Give either --window LO:HI or --limit-force N"
            wrong.append(Finding("--window and --limit-force", words, remedy))
        mode = "--window" if window else "--limit-force"
        wrong += [] if window == limit else options.without_meaning(unused, mode)
        models = _open(console, run, out, force, "design")
    asked = {name: value for name, value in given.items() if name not in unused}
    answer = wave_generator if window else inverse_design
    return console.show(answer(models, **asked), answer="design.json")


@command(short_help="Compute the force over sizes.")
@click.argument("run", metavar="RUN")
@options.repeated_option(
    "--vary",
    metavar="NAME=VALUES",
    read=partial(read_named, read=read_grid, known=lambda: AXES),
    help="Vary this quantity: wall_thickness_mm=0.6:0.76:5, radius_mm=35,40,45. Also "
    "length_mm, load_height_mm, deformation_mm, temperature_C. May be repeated.",
)
@click.option(
    "--deformation",
    type=LENGTH,
    help="Use this radial deformation [mm] [default: nominal].",
)
@click.option(
    "--temperature",
    type=float,
    help="Use this temperature [°C] [default: the reference temperature].",
)
@options.seed_option
@options.folder_options("Write the result to DIR [default: NAME-study].")
@options.json_option
@click.pass_obj
def study(console: Console, run, out, force, **asked):
    """Compute the force for every combination of sizes, from RUN.

    RUN is a folder of `hdcal calibrate` or `hdcal diagnose`.
    """
    from hdcal.design.study import study as run_study

    with console.wrong as wrong:
        if not options.is_given("vary"):
            remedy = "Give for example --vary wall_thickness_mm=0.6:0.76:5"
            wrong.append(Finding("vary", "no size is varied", remedy))
        models = _open(console, run, out, force, "study")
    found = run_study(models, **asked)
    tables = {"study.csv": found.to_frame()}
    return console.show(found, answer="study.json", tables=tables)
