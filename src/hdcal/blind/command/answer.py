"""`hdcal blind answer`: every case of a set diagnosed, the answers frozen."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import json_option

_INTERRUPTED = 130


@command(short_help="Diagnose every case of a set, and freeze the answers.")
@click.argument("folder", metavar="DIR")
@click.option(
    "--jobs",
    default=1,
    show_default=True,
    help="Processes to share the cases.",
)
@click.option(
    "--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers share them."
)
@click.option(
    "--library",
    metavar="minus:NAME[,NAME]",
    help="Leave effects out of every case's library.",
)
@click.option("--by", metavar="NAME", default="hdcal", show_default=True, help="Who.")
@json_option
@click.pass_obj
def answer(console: Console, folder, **settings) -> int:
    """Answer every case of DIR; an interrupted run goes on when it is run again."""
    from hdcal.blind.answer import FrozenAnswer
    from hdcal.blind.answering import answer_set
    from hdcal.cli.progress import progress_bar

    try:
        with progress_bar("answering") as progress:
            frozen = answer_set(folder, progress=progress, **settings)
    except KeyboardInterrupt:
        words = "what is answered is kept; run the same command again to go on"
        console.words(f"interrupted: {words}")
        return _INTERRUPTED
    console.result(f"answers {frozen['sha256']}")
    words = f"{len(frozen['answers'])} answers by '{frozen['by']}' are frozen"
    console.words(words)
    if not frozen["blind"]:
        console.words("NOT BLIND: this set was opened before")
    if console.json:
        next_step = f"Open it with its key: hdcal blind open {folder} --key FILE"
        said = {"headline": words, "next_step": next_step}
        console.data(FrozenAnswer(status="ok", reasons=(), **said, **frozen))
    return 0
