"""A command of hdcal: findings about a parameter are said of its option."""

from dataclasses import replace
from functools import partial

import click

from hdcal.errors import InputError


class Command(click.Command):
    """A command whose findings name options where the library names parameters."""

    def invoke(self, ctx: click.Context):
        """Run the command.

        Raises:
            InputError: with options in place of the library's parameters.
        """
        options = {p.name: _shown(p) for p in self.params if p.name is not None}
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise InputError(
                replace(finding, file=options[finding.file])
                if finding.file in options and finding.row is None
                else finding
                for finding in error.findings
            ) from error


def _shown(parameter: click.Parameter) -> str:
    """Return how a user writes a parameter: --option, or the name of an argument."""
    if isinstance(parameter, click.Option):
        return parameter.opts[0]
    return parameter.human_readable_name.strip("[]")


command = partial(click.command, cls=Command)
