"""Findings of the library, which name parameters, in the words of the command line."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import click

from hdcal.errors import Finding, InputError


@contextmanager
def options_named(**others: str) -> Iterator[None]:
    """Let findings about parameters name the options of the command that runs.

    A parameter belongs to the option that click calls the same, or that is spelled
    the same: `limit_force` is --limit-force. Findings about anything else stay.

    Args:
        others: option of a parameter that is called otherwise: `rates="--spring-rate"`.

    Raises:
        InputError: what was raised inside, with other names.
    """
    try:
        yield
    except InputError as error:
        options = _options(click.get_current_context().command) | others
        raise InputError(_named(one, options) for one in error.findings) from error


def _options(command: click.Command) -> dict[str, str]:
    found = {}
    for parameter in command.params:
        for option in parameter.opts if isinstance(parameter, click.Option) else ():
            if option.startswith("--"):
                found[option.removeprefix("--").replace("-", "_")] = option
                found[str(parameter.name)] = option
    return found


def _named(finding: Finding, options: dict[str, str]) -> Finding:
    return replace(finding, file=options.get(finding.file, finding.file))
