"""`hdcal diagnose`: where model and measurement part, why, and how far that closes."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import (
    force_option,
    json_option,
    library_option,
    reading_options,
    seed_option,
    take_reading,
)

# With more cases than this reports are made only when asked for.
MANY = 20


@command(short_help="Where, why and how far the model is off.")
@reading_options
@click.argument("cases", metavar="CASE...", nargs=-1, required=True)
@library_option
@click.option("--quick", is_flag=True, help="Answer without sampling: no margins.")
@click.option(
    "--report/--no-report",
    default=None,
    help=f"Figures and report of every case [default: with up to {MANY} cases].",
)
@click.option(
    "--jobs",
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
def diagnose(console: Console, cases, out, force, **settings):
    """Find the gap between model and measurement of each CASE, and its cause.

    Of one CASE the result is DIR itself, of several DIR/NAME each.
    """
    from hdcal.data.plausible import implausible
    from hdcal.diagnosis.library import choose_library
    from hdcal.diagnosis.many_cases import (
        REFUSED,
        diagnose_all,
        overview,
        read_cases,
        tell_notes,
    )
    from hdcal.physics.registry import EFFECTS

    with console.wrong as wrong:
        wrong += implausible("jobs", settings["jobs"])
        wrong += implausible("seed", settings["seed"])
        wrong.attempt(choose_library, settings["library"], EFFECTS)
        reading, asked = take_reading(settings), None
        if reading["columns"] is not None:
            asked = wrong.attempt(read_cases, cases, **reading)
        if out is None and asked is not None:
            out = asked.folder
        console.reserve_folder(out, force)
        if wrong and asked is not None:
            wrong.extend(asked.findings)
    assert asked is not None and console.folder is not None
    tell_notes(console, asked)
    if settings["report"] is None:
        settings["report"] = len(asked.found) <= MANY
        if not settings["report"]:
            console.words(f"more than {MANY} cases: no reports without --report")
    with console.folder.filled() as folder:
        found, left = diagnose_all(asked, folder, command=console.command, **settings)
        together = overview(found, left.refused)
        if asked.many:
            (folder / REFUSED).write_text(together.to_json(), "utf-8")
    (one, *_) = found.values()
    shown = together if one.shown is None else one.shown
    code = console.show_written(shown)
    return 2 if left.refused else code
