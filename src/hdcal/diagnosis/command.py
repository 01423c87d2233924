"""`hdcal diagnose`: where model and measurement part, why, and how far that closes."""

import click

from hdcal.cli.command import command
from hdcal.cli.compilation_cache import keep_compilations, one_thread_for_algebra
from hdcal.cli.console import Console
from hdcal.cli.options import force_option, json_option, reading_options, seed_option

# With more cases than this reports are made only when asked for.
MANY = 20


@command(short_help="Where, why and how far the model is off.")
@reading_options
@click.argument("cases", metavar="CASE...", nargs=-1, required=True)
@click.option(
    "--library",
    metavar="minus:NAME[,NAME]",
    help="Leave effects out of the library [default: all of them].",
)
@click.option("--quick", is_flag=True, help="Answer without sampling: no margins.")
@click.option(
    "--report/--no-report",
    default=None,
    help=f"Figures and report of every case [default: with up to {MANY} cases].",
)
@click.option(
    "--jobs",
    type=click.IntRange(1, 256),
    default=1,
    show_default=True,
    help="Processes to share many cases.",
)
@seed_option
@click.option(
    "--out",
    metavar="DIR",
    help="Result folder to make [default: NAME-diagnosis, of many cases diagnosis].",
)
@force_option
@json_option
@click.pass_obj
def diagnose(console: Console, cases, gear, columns, theory, out, force, **settings):
    """Find the gap between model and measurement of each CASE, and its cause.

    Of one CASE the result is DIR itself, of several DIR/NAME each.
    """
    one_thread_for_algebra()
    from hdcal.diagnosis.library import choose_library
    from hdcal.diagnosis.many_cases import diagnose_all, read_cases, tell_notes
    from hdcal.diagnosis.overview import document_and_answer
    from hdcal.physics.registry import EFFECTS

    with console.wrong as wrong:
        wrong.attempt(choose_library, settings["library"], EFFECTS)
        found = []
        if columns is not None:
            found = wrong.attempt(read_cases, cases, gear, columns, theory) or []
        if out is None and found:
            # Of many cases the folder is no single one's.
            out = f"{found[0].name}-diagnosis" if len(found) == 1 else "diagnosis"
        console.reserve_folder(out, force)
    keep_compilations()
    tell_notes(console, found)
    if settings["report"] is None:
        settings["report"] = len(found) <= MANY
        if not settings["report"]:
            console.words(f"more than {MANY} cases: no reports without --report")
    assert console.folder is not None
    with console.folder.filled() as folder:
        answers = diagnose_all(found, folder, command=console.command, **settings)
    opened = "report.html" if settings["report"] else "verdict.json"
    return console.answer(
        *document_and_answer(answers), out, opened if len(answers) == 1 else ""
    )
