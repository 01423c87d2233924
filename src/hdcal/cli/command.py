"""Command whose findings name its options in place of the library's parameters."""

import re
from dataclasses import replace
from functools import partial

import click

from hdcal.errors import Finding, InputError

# A parameter within the text of a finding.
_NAMED = re.compile(r"`(\w+)`")


class Command(click.Command):
    """A command whose findings name options."""

    def invoke(self, ctx: click.Context):
        """Run the command; an `InputError` names options."""
        options = {p.name: _shown(p) for p in self.params if p.name is not None}
        try:
            return super().invoke(ctx)
        except InputError as error:
            raise InputError(_of_options(f, options) for f in error.findings) from error


def _of_options(finding: Finding, options: dict[str, str]) -> Finding:
    def words(text: str) -> str:
        return _NAMED.sub(lambda name: options.get(name[1], name[0]), text)

    file = finding.file if finding.row else options.get(finding.file, finding.file)
    problem, remedy = words(finding.problem), words(finding.remedy)
    return replace(finding, file=file, problem=problem, remedy=remedy)


def _shown(parameter: click.Parameter) -> str:
    """Return a parameter as users write it: --option or ARGUMENT."""
    if isinstance(parameter, click.Option):
        return parameter.opts[0]
    return parameter.human_readable_name.strip("[]")


command = partial(click.command, cls=Command)
