"""`hdcal diagnose`: where model and measurement part, why, and how far that closes."""

import click

from hdcal.cli.compilation_cache import keep_compilations, one_thread_for_algebra
from hdcal.cli.console import Console
from hdcal.cli.options import (
    force_option,
    json_option,
    reading_options,
    seed_option,
)
from hdcal.errors import InputError

# With more cases than this reports are made only when asked for.
MANY = 20


@click.command(short_help="Where, why and how far the model is off.")
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
    from hdcal.diagnosis.many_cases import read_cases
    from hdcal.physics.registry import EFFECTS
    from hdcal.report.folder import check_target

    findings, found, target = [], [], out
    try:
        choose_library(settings["library"], EFFECTS)
    except InputError as error:
        findings += error.findings
    try:
        console.wrong.__exit__(None, None, None)
        found = read_cases(cases, gear, columns, theory)
        # Of many cases the folder is no single one's.
        name = f"{found[0].name}-diagnosis" if len(found) == 1 else "diagnosis"
        target = name if out is None else out
    except InputError as error:
        findings += error.findings
    if target is not None:
        try:
            check_target(target, force=force)
        except InputError as error:
            findings += error.findings
    if findings:
        raise InputError(findings)
    return _diagnose(console, found, settings, target, force)


def _diagnose(console: Console, cases, settings, target, force) -> int:
    keep_compilations()
    from hdcal.diagnosis.many_cases import diagnose_all
    from hdcal.diagnosis.terminal import closing_words, overview
    from hdcal.report.folder import whole_folder

    single = len(cases) == 1
    for case in cases:
        for note in case.notes:
            console.words(note if single else f"{case.name}: {note}")
    if settings["report"] is None:
        settings["report"] = len(cases) <= MANY
        if not settings["report"]:
            console.words(f"more than {MANY} cases: no reports without --report")
    with whole_folder(target, force=force) as folder:
        found = diagnose_all(cases, folder, **settings)
    verdicts = list(found.values())
    if single:
        words = closing_words(verdicts[0], str(target), report=settings["report"])
    else:
        words = overview(found, str(target))
    console.table(*words)
    if console.json:
        console.data(verdicts[0] if single else {"cases": found})
    return 0 if all(verdict["status"] == "ok" for verdict in verdicts) else 1
