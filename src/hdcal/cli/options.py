"""Options that several commands share."""

import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, get_args

import click
from click.core import ParameterSource

from hdcal.cli.console import Console
from hdcal.cli.option_types import (
    FORCE,
    read_all,
    read_columns,
    read_list,
    read_named,
    read_quantity,
)
from hdcal.data.theory_names import READINGS, Theory
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    from hdcal.data.case import Case


def repeated_option(
    *names: str, metavar: str, read: Callable[[Sequence[str], str], Any], help: str
) -> Callable[[Callable], Callable]:
    """Add an option that may be repeated.

    Args:
        names: of the option and of its parameter.
        metavar: form of its text.
        read: called with all texts and the option's name; raises `InputError`.
        help: what it means.
    """
    return click.option(
        *names, metavar=metavar, multiple=True, callback=read_all(read), help=help
    )


def sheet_option(command: Callable) -> Callable:
    """Add the option that says which sheet of a workbook is meant."""
    return repeated_option(
        "--sheet",
        metavar="NAME",
        read=_one,
        help="Of a workbook (.xlsx) [default: the one with readings]; 'Probe*' for "
        "several, each a specimen.",
    )(command)


def column_option(command: Callable) -> Callable:
    """Add the option that says which column is which quantity."""
    return repeated_option(
        "--column",
        "columns",
        metavar="QUANTITY=HEADER",
        read=read_columns,
        help="Read a quantity from a header of your own: force=Load[kgf].",
    )(command)


def _one(texts: Sequence[str], option: str) -> str | None:
    if len(texts) > 1:
        words = f"is given {len(texts)} times"
        remedy = "Name one; several that are called alike are 'Probe*'"
        raise InputError([Finding(option, words, remedy)])
    return texts[0] if texts else None


def case_options(command: Callable) -> Callable:
    """Add the argument and options that say which case to read."""
    return reading_options(click.argument("data", metavar="DATA")(command))


def reading_options(command: Callable) -> Callable:
    """Add the options that say how cases are read."""
    for add in (
        click.option(
            "--theory",
            type=click.Choice(get_args(Theory)),
            help="Stiffness formula that K multiplies; overrides the gear file.",
        ),
        column_option,
        sheet_option,
        click.option(
            "--specimen",
            metavar="LABEL",
            help="Of several in the data, the one whose rows are read.",
        ),
        click.option(
            "--reading",
            type=click.Choice(READINGS),
            help="Of the deformation, where the gear file is silent [default: radial].",
        ),
        click.option(
            "--encoding",
            metavar="NAME",
            help="Of the data file's text [default: what it looks like].",
        ),
        click.option(
            "--gear",
            metavar="GEAR.toml",
            help="The gear file [default: gear.toml beside the data].",
        ),
    ):
        command = add(command)
    return command


def take_reading(settings: dict) -> dict:
    """Take the values of `reading_options` out of a command's settings."""
    names = "gear", "columns", "theory", "encoding", "sheet", "reading", "specimen"
    return {name: settings.pop(name) for name in names}


def read_given(console: Console, data, gear, columns, **how) -> "Case | None":
    """Read the case that `case_options` named; what is wrong is kept by the console.

    On a terminal it asks for what the gear file leaves open.
    """
    from hdcal.data.reading import read_case

    if columns is None or is_refused(console, "--sheet"):  # which is said already
        return None
    read = partial(read_case, columns=columns)
    case = console.wrong.attempt(read, data, gear, **how)
    reading = asked_reading(console, case)
    if reading is None:
        return case
    how["reading"] = reading
    return console.wrong.attempt(read, data, gear, **how)


def is_refused(console: Console, option: str) -> bool:
    """Tell whether what an option says could not be read."""
    return any(finding.file == option for finding in console.wrong)


def asked_reading(console: Console, case: "Case | None") -> str | None:
    """Return how the deformation is read, where nothing says so but who sits there.

    None where it is known, or nobody can be asked.
    """
    from hdcal.data.reading import leaves_reading_open

    streams = sys.stdin, sys.stderr
    asks = all(each is not None and each.isatty() for each in streams)
    asks = asks and not console.json
    if case is None or not asks or not leaves_reading_open(case.gear):
        return None
    words = "Deformation as read, radial or diametral"
    kinds = click.Choice(READINGS)
    return click.prompt(words, default="radial", type=kinds, err=True)


def library_option(command: Callable) -> Callable:
    """Add --library."""
    words = "Leave effects out of the library [default: all of them]."
    return click.option("--library", metavar="minus:NAME[,NAME]", help=words)(command)


def skip_bad_option(command: Callable) -> Callable:
    """Add --skip-bad."""
    words = "Leave out gears of which something is wrong, whole, and say so."
    return click.option("--skip-bad", is_flag=True, help=words)(command)


def json_option(command: Callable) -> Callable:
    """Add --json; the console knows it already, click has to accept it."""
    words = "Print one JSON object; words go to standard error."
    option = click.option(
        "--json", "_json", is_flag=True, expose_value=False, help=words
    )
    return option(command)


def folder_options(help: str) -> Callable[[Callable], Callable]:
    """Add --out and --force.

    Args:
        help: which folder --out names, and which one it is by default.
    """

    def add(command: Callable) -> Callable:
        return click.option("--out", metavar="DIR", help=help)(force_option(command))

    return add


# For a command that writes a folder where it is asked to.
out_option = folder_options("Also write a folder with a report.")


def force_option(command: Callable) -> Callable:
    """Add --force."""
    words = "Replace an older result of hdcal."
    return click.option("--force", is_flag=True, help=words)(command)


def direction_option(
    help: str, default: str | None = "up"
) -> Callable[[Callable], Callable]:
    """Add --direction.

    Args:
        help: what up and down are.
        default: without it.
    """
    ways = click.Choice(["up", "down"])
    return click.option(
        "--direction", type=ways, default=default, show_default=True, help=help
    )


def start_options(command: Callable) -> Callable:
    """Add RUN and --gear, for a command that needs one of the two."""
    words = "Without RUN: a gear of which priors are known."
    option = click.option("--gear", metavar="GEAR.toml", help=words)
    return click.argument("run", metavar="RUN", required=False)(option(command))


def decision_options(command: Callable) -> Callable:
    """Add --limit-force and --rule."""
    words = "Capacity of the actuator [N]: its size, in compression and in tension."
    limit = click.option("--limit-force", type=FORCE, help=words)
    rules = click.Choice(["guarded", "simple"])
    words = "Decision about it, by the expanded uncertainty or not [default: guarded]."
    return limit(click.option("--rule", type=rules, help=words)(command))


def certificate_option(command: Callable) -> Callable:
    """Add --certificate."""
    words = "Also write a certificate to sign, one A4 page."
    return click.option("--certificate", is_flag=True, help=words)(command)


def material_option(help: str) -> Callable[[Callable], Callable]:
    """Add --material."""
    return repeated_option(
        "--material", "materials", metavar="NAME", read=read_list, help=help
    )


def tolerance_option(command: Callable) -> Callable:
    """Add --tolerance."""
    return repeated_option(
        "--tolerance",
        "tolerances",
        metavar="SIZE_mm=±",
        read=partial(read_named, read=partial(read_quantity, unit="mm")),
        help="Tolerance of a size: wall_thickness_mm=0.02; may be repeated.",
    )(command)


def seed_option(command: Callable) -> Callable:
    """Add --seed."""
    return click.option(
        "--seed",
        default=0,
        show_default=True,
        help="The same seed gives the same result.",
    )(command)


def is_given(name: str) -> bool:
    """Tell whether a parameter stands on the command line, readable or not."""
    source = click.get_current_context().get_parameter_source(name)
    return source is ParameterSource.COMMANDLINE


def needs_folder(name: str, given: bool, out: str | None) -> list[Finding]:
    """Return a finding where a parameter was given that needs a result folder.

    Args:
        name: of the parameter.
        given: whether it was.
        out: the folder, or None.
    """
    words, remedy = "is written into a result folder", "Give `out` too"
    return [Finding(name, words, remedy)] if given and out is None else []


def without_meaning(names: Sequence[str], mode: str) -> list[Finding]:
    """Return a finding for each parameter that was given in spite of an option.

    Args:
        names: of parameters that do not go with it.
        mode: the option.
    """
    words = f"has no meaning with {mode}"
    return [Finding(name, words, "leave it out") for name in names if is_given(name)]
