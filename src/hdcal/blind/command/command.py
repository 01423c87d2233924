"""`hdcal blind`: cases under seal, answers without their truth, and the opening."""

import click

from hdcal.blind.command.answer import answer
from hdcal.blind.command.make import make
from hdcal.blind.command.open import open_


@click.group(short_help="Seal cases, answer them blind, open and score.")
def blind() -> None:
    """Check the diagnosis on cases whose causes it cannot know.

    `make` seals cases and prints a commitment to them, `answer` diagnoses them and
    freezes the answers, `open` verifies both and scores.
    """


for _command in (make, answer, open_):
    blind.add_command(_command)
