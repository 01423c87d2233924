"""Options that say how long to sample."""

from collections.abc import Callable

import click

from hdcal.cli.options import seed_option


def sampling_options(command: Callable) -> Callable:
    """Add --chains, --warmup, --draws and --seed."""
    command = seed_option(command)
    for option, number, words in (
        ("--draws", 1000, "Draws kept per chain."),
        ("--warmup", 1000, "Iterations of adaptation per chain."),
        ("--chains", 4, "Independent chains."),
    ):
        command = click.option(option, default=number, show_default=True, help=words)(
            command
        )
    return command
