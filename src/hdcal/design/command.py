"""`hdcal design` and `hdcal study`."""

from functools import partial
from pathlib import Path
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
_OF_WINDOW = ("window", "setting_sd", "rates")
_OF_LIMIT = ("limit_force", "limit_stress", "deformation", "vary", "materials")


def _open(console: Console, run, gear, out, force, kind: str) -> Any:
    """Return the calibration or gear, and reserve the folder of the result."""
    from hdcal.data.gear import read_gear
    from hdcal.inference.model_average import load_models

    if (run is None) == (gear is None):
        words = "is missing" if run is None else "and `gear` are given both"
        remedy = "Name a folder of hdcal calibrate, or `gear` GEAR.toml for priors only"
        console.wrong.append(Finding("run", words, remedy))
        return None
    if gear is not None:
        source, name = console.wrong.attempt(read_gear, gear), Path(gear).stem
    else:
        source = console.wrong.attempt(load_models, run)
        name = "" if source is None else source.case.name
    if source is not None:
        console.reserve_folder(out or f"{name}-{kind}", force)
    return source


@command(short_help="Design a wave generator, or sizes for a limit.")
@options.start_options
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
    "--spring-rate",
    "rates",
    type=ENDS,
    help="Consider spring rates in this range [N/mm].",
)
@click.option(
    "--limit-force", type=FORCE, help="Design sizes that keep the force below this [N]."
)
@click.option(
    "--limit-stress",
    type=STRESS,
    help="Keep the stress below this [MPa] [default: the yield strength].",
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
@options.material_option("Choose among materials [default: that of the gear].")
@click.option(
    "--temperature",
    "temperatures",
    type=Parsed("LO:HI", read_window),
    help="Require it at these temperatures [°C] [default: the reference temperature].",
)
@click.option(
    "--probability", default=0.99, help="Require this probability [default: 0.99]."
)
@options.tolerance_option
@options.seed_option
@options.folder_options("Write the result to DIR [default: NAME-design].")
@options.json_option
@click.pass_obj
def design(console: Console, run, gear, out, force, **given):
    """Design from RUN, a result folder of `hdcal calibrate`.

    --window designs the softest spring of an elastic wave generator that keeps the
    gear between backlash, at the end nearer to zero, and jamming, at the other end.
    --limit-force designs the sizes nearest to the tested ones that keep the limit.
    """
    from hdcal.design.inverse_design import inverse_design
    from hdcal.design.wave_generator import wave_generator

    window, limit = options.is_given("window"), options.is_given("limit_force")
    unused = _OF_LIMIT if window else _OF_WINDOW
    with console.wrong as wrong:
        if window == limit:
            words = "both ask at once" if window else "nothing is asked"
            remedy = "Say either --window LO:HI or --limit-force N"
            wrong.append(Finding("--window and --limit-force", words, remedy))
        mode = "--window" if window else "--limit-force"
        wrong += [] if window == limit else options.without_meaning(unused, mode)
        source = _open(console, run, gear, out, force, "design")
    asked = {name: value for name, value in given.items() if name not in unused}
    answer = wave_generator if window else inverse_design
    return console.show(answer(source, **asked), answer="design.json")


@command(short_help="Compute the force over sizes and materials.")
@options.start_options
@options.repeated_option(
    "--vary",
    metavar="NAME=VALUES",
    read=partial(read_named, read=read_grid, known=lambda: AXES),
    help="Vary wall_thickness_mm=0.6:0.76:5 or radius_mm=35,40,45. May be repeated. "
    "Also length_mm, load_height_mm, deformation_mm, temperature_C.",
)
@options.material_option("Compare materials [default: that of the gear].")
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
def study(console: Console, run, gear, out, force, **asked):
    """Compute the force for every combination of sizes from RUN.

    RUN is a result folder of `hdcal calibrate`.
    """
    from hdcal.design.study import study as run_study

    with console.wrong as wrong:
        if not (options.is_given("vary") or options.is_given("materials")):
            remedy = "Say --vary wall_thickness_mm=0.6:0.76:5"
            wrong.append(Finding("vary", "nothing is varied", remedy))
        source = _open(console, run, gear, out, force, "study")
    found = run_study(source, **asked)
    tables = {"study.csv": found.to_frame()}
    return console.show(found, answer="study.json", tables=tables)
