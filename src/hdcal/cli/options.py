"""Options that several commands share."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, get_args

import click
from click.core import ParameterSource

from hdcal.cli.console import Console
from hdcal.cli.option_types import (
    read_all,
    read_columns,
    read_named,
    read_quantity,
)
from hdcal.data.theory_names import READINGS, Theory
from hdcal.errors import Finding

if TYPE_CHECKING:
    from hdcal.data.case import Case

# Adds one or several options to a command.
Decorator = Callable[[Callable], Callable]


def combined(*options: Decorator) -> Decorator:
    """Return one decorator for several options, shown in this order in the help."""

    def add(command: Callable) -> Callable:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def repeated_option(
    *names: str, metavar: str, read: Callable[[Sequence[str], str], Any], help: str
) -> Decorator:
    """Return an option that may be repeated.

    Args:
        names: of the option and of its parameter.
        metavar: form of its text.
        read: called with all texts and the option's name; raises `InputError`.
        help: its meaning.
    """
    return click.option(
        *names, metavar=metavar, multiple=True, callback=read_all(read), help=help
    )


sheet_option = click.option(
    "--sheet",
    metavar="NAME",
    help="Of a workbook (.xlsx) [default: the one with readings]; 'Probe*' for "
    "several, each a specimen.",
)
column_option = repeated_option(
    "--column",
    "columns",
    metavar="QUANTITY=HEADER",
    read=read_columns,
    help="Read a quantity from a header of your own: force=Load[kgf].",
)
# How cases are read.
reading_options = combined(
    click.option(
        "--gear",
        metavar="GEAR.toml",
        help="The gear file [default: gear.toml beside the data].",
    ),
    click.option(
        "--encoding",
        metavar="NAME",
        help="Of the data file's text [default: what it looks like].",
    ),
    click.option(
        "--reading",
        type=click.Choice(READINGS),
        help="Of the deformation, where the gear file is silent [default: radial].",
    ),
    click.option(
        "--specimen",
        metavar="LABEL",
        help="Of several in the data, the one whose rows are read.",
    ),
    sheet_option,
    column_option,
    click.option(
        "--range",
        metavar="LOW:HIGH",
        help="Working range: 0.1:0.6 of the deformation [mm], 10%:40% of the largest "
        "force, straight for the longest straight part, or all until the force drops "
        "for good [default: all; of calibrate straight, for a curve that is no line].",
    ),
    click.option(
        "--theory",
        type=click.Choice(get_args(Theory)),
        help="Stiffness formula that K multiplies; overrides the gear file.",
    ),
)
# Which case is read, and how.
case_options = combined(reading_options, click.argument("data", metavar="DATA"))


def take_reading(settings: dict) -> dict:
    """Take the values of `reading_options` out of a command's settings."""
    names = "gear", "columns", "theory", "encoding", "sheet", "reading", "specimen"
    names += ("range",)
    return {name: settings.pop(name) for name in names}


def read_given(console: Console, data, gear, columns, **how) -> "Case | None":
    """Read the case that `case_options` named; the console collects what is wrong."""
    from hdcal.data.reading import read_case

    if columns is None:  # The console has that finding already.
        return None
    return console.wrong.attempt(read_case, data, gear, columns=columns, **how)


library_option = click.option(
    "--library",
    metavar="minus:NAME[,NAME]",
    help="Leave effects out of the library [default: all of them].",
)
skip_bad_option = click.option(
    "--skip-bad",
    is_flag=True,
    help="Leave out gears of which something is wrong, whole, and say so.",
)
# The console knows it already; click has to accept it.
json_option = click.option(
    "--json",
    "_json",
    is_flag=True,
    expose_value=False,
    help="Print one JSON object; words go to standard error.",
)
force_option = click.option(
    "--force", is_flag=True, help="Replace an older result of hdcal."
)


def folder_options(help: str) -> Decorator:
    """Return --out and --force.

    Args:
        help: which folder --out names, and which one it is by default.
    """
    return combined(click.option("--out", metavar="DIR", help=help), force_option)


# For a command that writes a folder only if asked.
out_option = folder_options("Also write a folder with a report.")


def direction_option(help: str, default: str | None = "up") -> Decorator:
    """Return --direction.

    Args:
        help: what up and down are.
        default: without it.
    """
    ways = click.Choice(["up", "down"])
    return click.option(
        "--direction", type=ways, default=default, show_default=True, help=help
    )


tolerance_option = repeated_option(
    "--tolerance",
    "tolerances",
    metavar="SIZE_mm=±",
    read=partial(read_named, read=partial(read_quantity, unit="mm")),
    help="Tolerance of a size: wall_thickness_mm=0.02; may be repeated.",
)
seed_option = click.option(
    "--seed",
    default=0,
    show_default=True,
    help="The same seed gives the same result.",
)
sampling_options = combined(
    click.option("--chains", default=4, show_default=True, help="Independent chains."),
    click.option(
        "--warmup",
        default=1000,
        show_default=True,
        help="Iterations of adaptation per chain.",
    ),
    click.option(
        "--draws", default=1000, show_default=True, help="Draws kept per chain."
    ),
    seed_option,
)


def is_given(name: str) -> bool:
    """Return whether a parameter was given on the command line, readable or not."""
    source = click.get_current_context().get_parameter_source(name)
    return source is ParameterSource.COMMANDLINE


def without_meaning(names: Sequence[str], mode: str) -> list[Finding]:
    """Return a finding for each parameter that was given in spite of an option.

    Args:
        names: of parameters that do not go with it.
        mode: the option.
    """
    words = f"has no meaning with {mode}"
    return [Finding(name, words, "leave it out") for name in names if is_given(name)]
