"""A command that reports findings about parameters as findings about options."""

import re
from dataclasses import replace
from functools import partial

import click

from hdcal.errors import Finding, InputError

# How findings write a parameter within their words.
_NAMED = re.compile(r"`(\w+)`")


class Command(click.Command):
    """A command whose findings name its options instead of the parameters."""

    def invoke(self, ctx: click.Context):
        """Run the command.

        Raises:
            InputError: with options in place of the library's parameters.
        """
        options = {p.name: _shown(p) for p in self.params if p.name is not None}
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise InputError(_of_options(f, options) for f in error.findings) from error


def _of_options(finding: Finding, options: dict[str, str]) -> Finding:
    """Return a finding with options in place of the library's parameters."""

    def words(text: str) -> str:
        return _NAMED.sub(lambda name: options.get(name[1], name[0]), text)

    file = finding.file if finding.row else options.get(finding.file, finding.file)
    said = {"problem": words(finding.problem), "remedy": words(finding.remedy)}
    return replace(finding, file=file, **said)


def _shown(parameter: click.Parameter) -> str:
    """Return a parameter as users write it: --option, or the name of an argument."""
    if isinstance(parameter, click.Option):
        return parameter.opts[0]
    return parameter.human_readable_name.strip("[]")


command = partial(click.command, cls=Command)
