"""`hdcal blind open`: everything verified, the labels decrypted, the answers scored."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import json_option
from hdcal.errors import said_if_interrupted

if TYPE_CHECKING:
    from hdcal.blind.open import OpenedSet


@command("open", short_help="Verify everything, decrypt the labels, score.")
@click.argument("folder", metavar="DIR")
@click.option("--key", metavar="FILE", required=True, help="Key of the set.")
@click.option(
    "--by",
    metavar="NAME",
    multiple=True,
    help="Whose answers to score [default: all of them].",
)
@json_option
@click.pass_obj
def open_(console: Console, folder, key, by) -> None:
    """Open DIR, score its frozen answers, and write DIR/result."""
    from hdcal.blind.open import open_set

    opened = open_set(folder, Path(key), tuple(dict.fromkeys(by)))
    with said_if_interrupted(f"{opened.folder} is written"):
        _tell(console, opened)


def _tell(console: Console, opened: "OpenedSet") -> None:
    """Print what was opened, and how the answers scored."""
    from hdcal.blind.answer import ScoresAnswer
    from hdcal.report.terminal import terminal_lines

    console.result(f"commitment {opened.opening.set_commitment}")
    for name, one in opened.opening.answers.items():
        console.result(f"answers {one.sha256} by '{name}'")
        if not one.blind:
            words = "were frozen after the set was opened"
            console.words(f"NOT BLIND: the answers of '{name}' {words}")
    if not_bound := ", ".join(opened.opening.not_bound):
        console.words(f"the commitment of this older set does not bind: {not_bound}")
    if opened.before is not None:
        words = "its record stays, and what was answered since is not blind"
        console.words(f"this set was opened before, at {opened.before}: {words}")
    console.words(f"verified and scored: {opened.folder}")
    document = opened.report.document
    if console.json:
        words = {"headline": document.headline, "next_step": None}
        found = {**vars(opened.opening), "scores": opened.report.answer}
        console.data(ScoresAnswer(status="ok", reasons=(), **words, **found))
    else:
        console.table(*terminal_lines(document, str(opened.folder)))
