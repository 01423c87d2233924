"""`hdcal compare`: the stiffness of finished results."""

from pathlib import Path

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console


@command(short_help="Compare the stiffness of finished results.")
@click.argument("results", metavar="RUN...", nargs=-1, required=True)
@click.option(
    "--tolerance",
    type=float,
    metavar="N/mm",
    help="Set the difference of stiffness, as read, that matters.",
)
@options.folder_options("Write a result folder with a report to DIR.")
@options.json_option
@click.pass_obj
def compare(console: Console, results, out, force, **asked):
    """Compare the stiffness of each RUN with that of the first.

    RUN is a result folder of `hdcal calibrate` or `hdcal diagnose`.
    """
    from hdcal.comparison.compare import compare as compared
    from hdcal.inference.model_average import load_models

    names = [Path(run).resolve().name for run in results]
    if len(set(names)) < len(names):
        names = results
    with console.wrong as wrong:
        runs = dict(zip(names, results, strict=True))
        models = {name: wrong.attempt(load_models, run) for name, run in runs.items()}
        console.reserve_folder(out, force)
    found = compared({n: m for n, m in models.items() if m is not None}, **asked)
    return console.show(found, tables={"gears.csv": found.to_frame()})
