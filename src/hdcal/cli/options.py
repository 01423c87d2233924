"""Options that several commands share."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from hdcal.cli.console import Console
from hdcal.cli.option_types import (
    read_all,
    read_named,
    read_quantity,
)
from hdcal.errors import Finding

if TYPE_CHECKING:
    from hdcal.data.case import Case

Decorator = Callable[[Callable], Callable]


def combined(*options: Decorator) -> Decorator:
    """Return one decorator for several options, in the order of the help."""

    def add(command: Callable) -> Callable:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def repeated_option(
    *names: str, metavar: str, read: Callable[[Sequence[str], str], Any], help: str
) -> Decorator:
    """Return an option that may be repeated; `read` takes all texts and its name."""
    return click.option(
        *names, metavar=metavar, multiple=True, callback=read_all(read), help=help
    )


sheet_option = click.option(
    "--sheet",
    metavar="NAME",
    help="Read this sheet of a workbook (.xlsx) [default: the one with readings].",
)
column_option = repeated_option(
    "--column",
    "columns",
    metavar="QUANTITY=HEADER",
    read=partial(
        read_named,
        read=lambda header, _: header,
        fault="names no header",
        example="force=Load[kgf]",
    ),
    help="Read a quantity from a column: force=Load[kgf]. May be repeated.",
)
# How cases are read.
reading_options = combined(
    click.option(
        "--gear",
        metavar="GEAR.toml",
        help="Read the gear from this file [default: gear.toml in the folder of the "
        "data].",
    ),
    click.option(
        "--encoding",
        metavar="NAME",
        help="Decode the data file with this encoding [default: detected].",
    ),
    click.option(
        "--specimen", metavar="LABEL", help="Read the rows of this specimen only."
    ),
    sheet_option,
    column_option,
    click.option(
        "--range",
        metavar="LOW:HIGH",
        help="Use the readings in a range: 0.1:0.6 (deformation [mm] or angle [rad]), "
        "10%:40% (of the largest force), straight (the longest straight part) or all "
        "(until the force drops permanently) [default: all; calibrate uses straight if "
        "the curve is not straight].",
    ),
)
# Which case is read, and how.
case_options = combined(reading_options, click.argument("data", metavar="DATA"))


def take_reading(settings: dict) -> dict:
    """Take the values of `reading_options` out of a command's settings."""
    names = "gear", "columns", "encoding", "sheet", "specimen", "range"
    return {name: settings.pop(name) for name in names}


def read_given(console: Console, data, gear, columns, **how) -> "Case | None":
    """Read the case of `case_options`; the console collects findings."""
    from hdcal.data.reading import read_case

    if columns is None:  # The console has that finding already.
        return None
    return console.wrong.attempt(read_case, data, gear, columns=columns, **how)


library_option = click.option(
    "--library",
    metavar="minus:NAME[,NAME]",
    help="Leave effects out of the library [default: all effects].",
)
skip_bad_option = click.option(
    "--skip-bad",
    is_flag=True,
    help="Leave out gears with faulty data, and list them.",
)
# Read by the program before the command; declared so that click accepts it.
json_option = click.option(
    "--json",
    "_json",
    is_flag=True,
    expose_value=False,
    help="Print one JSON object; messages go to standard error.",
)
force_option = click.option(
    "--force", is_flag=True, help="Replace an older result of hdcal."
)


def folder_options(help: str) -> Decorator:
    """Return --out, with this help, and --force."""
    return combined(click.option("--out", metavar="DIR", help=help), force_option)


# For a command that writes a folder only if asked.
out_option = folder_options("Write a result folder with a report to DIR.")


def direction_option(help: str, default: str | None = "up") -> Decorator:
    """Return --direction, with this help and default."""
    ways = click.Choice(["up", "down"])
    return click.option(
        "--direction", type=ways, default=default, show_default=True, help=help
    )


tolerance_option = repeated_option(
    "--tolerance",
    "tolerances",
    metavar="SIZE_mm=±",
    read=partial(read_named, read=partial(read_quantity, unit="mm")),
    help="Let a size vary by its tolerance: wall_thickness_mm=0.02. May be repeated.",
)
seed_option = click.option(
    "--seed",
    default=0,
    show_default=True,
    help="Set the seed of all random numbers.",
)
sampling_options = combined(
    click.option(
        "--chains", default=4, show_default=True, help="Set the number of chains."
    ),
    click.option(
        "--warmup",
        default=1000,
        show_default=True,
        help="Set the number of warm-up iterations per chain.",
    ),
    click.option(
        "--draws",
        default=1000,
        show_default=True,
        help="Set the number of draws per chain.",
    ),
    seed_option,
)


def is_given(name: str) -> bool:
    """Return whether a parameter is on the command line, readable or not."""
    source = click.get_current_context().get_parameter_source(name)
    return source is ParameterSource.COMMANDLINE


def without_meaning(names: Sequence[str], mode: str) -> list[Finding]:
    """Return a finding for each of these parameters that was given with a mode."""
    problem = f"cannot be combined with {mode}"
    return [Finding(name, problem, "Leave it out") for name in names if is_given(name)]
