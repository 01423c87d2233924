"""`hdcal compare`: the stiffness of finished results."""

import os
from pathlib import Path

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.errors import Finding


@command(short_help="Finished results side by side: how they differ, how surely.")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True)
@click.option(
    "--tolerance",
    type=float,
    metavar="N/mm",
    help="Difference of stiffness that matters, as read.",
)
@options.seed_option
@options.folder_options("Write a result folder with a report.")
@options.json_option
@click.pass_obj
def compare(console: Console, runs, out, force, **asked):
    """Compare the stiffness of each RUN with that of the first.

    RUN is a folder of `hdcal calibrate` or `hdcal diagnose`.
    """
    from hdcal.comparison.compare import compare as side_by_side
    from hdcal.inference.model_average import load_models

    with console.wrong as wrong:
        names = _names(runs)
        once = {_folder(run) for run in runs}
        if len(runs) < 2 or len(once) < len(runs):
            words = "two results or more are compared, each once"
            wrong.append(Finding("runs", words, "Name the folders of two results"))
        results = {n: wrong.attempt(load_models, run) for n, run in names.items()}
        console.reserve_folder(out, force)
    read = {name: models for name, models in results.items() if models is not None}
    found = side_by_side(read, **asked)
    return console.show(found, tables={"gears.csv": found.to_frame()})


def _folder(run: str) -> Path:
    """Return the folder of a result, however it is spelled."""
    from hdcal.inference.posterior_file import FILE_NAME

    path = Path(os.path.realpath(run))
    return path.parent if path.name == FILE_NAME else path


def _names(runs: tuple[str, ...]) -> dict[str, str]:
    """Return the folders by their names, by their paths where two have one name."""
    last = [_folder(run).name or run for run in runs]
    alone = len(set(last)) == len(set(runs))
    return {name if alone else run: run for name, run in zip(last, runs, strict=True)}
