"""Options that describe a force over time, and how their texts are read."""

from typing import TYPE_CHECKING

import click

from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE, Parsed, read_columns
from hdcal.cli.options import combined, repeated_option
from hdcal.errors import Finding, InputError

if TYPE_CHECKING:
    import numpy as np

_SHAPES = ("step", "sine", "chirp")


def read_tones(text: str, option: str) -> list[float]:
    """Read 5 or 5:200 as numbers.

    Raises:
        InputError: it is neither.
    """
    try:
        return [float(part) for part in text.split(":")]
    except ValueError:
        words = f"'{text}' is no frequency"
        remedy = "Write it like 5, or 5:200 for a chirp"
        raise InputError([Finding(option, words, remedy)]) from None


force_options = combined(
    click.option(
        "--force",
        required=True,
        metavar="F.csv|step|sine|chirp",
        help="The force on the gear: a table with time_s and force_N, or a shape.",
    ),
    repeated_option(
        "--column",
        "columns",
        metavar="QUANTITY=HEADER",
        read=read_columns,
        help="Read a quantity of F.csv from a header of your own: force=Load[kgf].",
    ),
    click.option("--amplitude", type=FORCE, help="Of a shape [N] [default: 80]."),
    click.option(
        "--frequency",
        type=Parsed("HZ", read_tones),
        help="Of a sine [Hz]: 5; of a chirp its first and last: 5:200.",
    ),
    click.option(
        "--duration", type=float, metavar="S", help="Of a shape [s] [default: 0.5]."
    ),
)


def read_drive(
    console: Console, force: str, columns: dict[str, str] | None, amplitude
) -> "str | tuple[np.ndarray, np.ndarray]":
    """Return the shape, or the time and force of the table, that --force names.

    The console collects what is wrong.

    Args:
        console: of the command.
        force: a shape or the path of a table.
        columns: headers of the table by quantity; None where they cannot be read.
        amplitude: of a shape; a table has its own.
    """
    from hdcal.data.measurements.force_table import read_force

    if force in _SHAPES:
        return force
    if amplitude is not None:
        words = "a sampled force has its own"
        console.wrong.append(Finding("amplitude", words, "Leave it out"))
    return console.wrong.attempt(read_force, force, columns or {}) or ""
