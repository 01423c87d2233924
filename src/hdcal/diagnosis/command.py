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


@command(short_help="Find the gap between model and data, and its causes.")
@reading_options
@click.argument("cases", metavar="CASE...", nargs=-1, required=True)
@library_option
@click.option(
    "--quick",
    is_flag=True,
    help="Skip sampling; the result cannot be used by predict or margin.",
)
@click.option("--no-report", is_flag=True, help="Write no figures and no report.")
@click.option(
    "--jobs",
    default=1,
    show_default=True,
    help="Set the number of processes for many cases.",
)
@seed_option
@click.option(
    "--out",
    metavar="DIR",
    help="Write the result to DIR [default: NAME-diagnosis; many cases: diagnosis].",
)
@force_option
@json_option
@click.pass_obj
def diagnose(console: Console, cases, out, force, jobs, no_report, **settings):
    """Find the gap between model and data of each CASE, and its causes.

    The result of one CASE is DIR, those of several are DIR/NAME.
    """
    from hdcal.cli.progress import progress_bar
    from hdcal.data.plausible import implausible
    from hdcal.diagnosis.library import choose_library
    from hdcal.diagnosis.many_cases import (
        all_findings,
        diagnose_into,
        diagnose_many,
        read_cases,
    )

    many, found, refused = len(cases) > 1, [], {}
    with console.wrong as wrong:
        wrong += implausible("jobs", jobs)
        wrong += implausible("seed", settings["seed"])
        wrong.attempt(choose_library, settings["library"])
        reading = take_reading(settings)
        if reading["columns"] is not None:
            read = wrong.attempt(read_cases, cases, **reading)
            found, refused = read or (found, refused)
        if out is None and found:
            out = "diagnosis" if many else f"{found[0].name}-diagnosis"
        console.reserve_folder(out, force)
        if wrong:
            wrong.extend(all_findings(refused))
    assert found and console.folder is not None
    for case in found:
        for note in case.notes:
            console.words(f"{case.name}: {note}" if many else note)
    how = {"command": console.command, "report": not no_report, **settings}
    with console.folder.filled() as folder:
        if many:
            shown = diagnose_many(found, refused, folder, jobs=jobs, **how)
            return_code = 2 if shown.refused else 0
        else:
            with progress_bar("diagnosing") as progress:
                shown = diagnose_into(folder, found[0], progress=progress, **how)
            return_code = 0
    return max(console.show_written(shown), return_code)
