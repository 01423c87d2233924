"""Options that say how long to sample."""

from collections.abc import Callable

import click

from hdcal.cli.options import seed_option


def sampling_options(command: Callable) -> Callable:
    """Add --chains, --warmup, --draws and --seed."""
    many = click.IntRange(1, 1_000_000)
    command = seed_option(command)
    for option, kind, number, words in (
        ("--draws", many, 1000, "Draws kept per chain."),
        ("--warmup", many, 1000, "Iterations of adaptation per chain."),
        ("--chains", click.IntRange(1, 64), 4, "Independent chains."),
    ):
        command = click.option(
            option, type=kind, default=number, show_default=True, help=words
        )(command)
    return command
