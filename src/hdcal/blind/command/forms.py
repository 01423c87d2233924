"""The two forms of `hdcal blind make`: cases drawn, or a measurement."""

import click

from hdcal.cli.options import is_given

# Parameters of one form only; of each the first two are needed.
_DRAWN, _REAL = ("cases", "mix", "seed", "program"), ("cause", "gear", "withhold")


def check_forms(real: bool) -> None:
    """Refuse a mixture of the two forms of `make`, or half of one."""
    own, foreign = (_REAL, _DRAWN) if real else (_DRAWN, _REAL)
    for name in own[:2]:
        if not is_given(name):
            raise click.UsageError(f"Missing option '--{name}'.")
    for name in filter(is_given, foreign):
        form = "with" if real else "without"
        raise click.UsageError(f"--{name} means nothing {form} --from.")
