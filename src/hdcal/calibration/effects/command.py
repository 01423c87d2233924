"""`hdcal effects`: the library as a table."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import json_option


@command("effects", short_help="List the library of effects.")
@json_option
@click.pass_obj
def effects(console: Console):
    """List the effects that `hdcal calibrate --effect NAME` can include."""
    from hdcal.calibration.effects.effects import effects as library

    return console.show(library())
