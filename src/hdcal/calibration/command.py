"""`hdcal calibrate`: from measurements to a result folder."""

import shlex
import sys

import click

from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    force_option,
    json_option,
    read_given,
    seed_option,
)
from hdcal.errors import Finding, InputError

_MANY = click.IntRange(1, 1_000_000)


@click.command(short_help="From measurements to a result folder.")
@case_options
@click.option(
    "--effect",
    "effects",
    metavar="NAME",
    multiple=True,
    help="Include an effect of the library; may be repeated.",
)
@click.option(
    "--with-gap",
    is_flag=True,
    help="Fit what no effect explains as a smooth leftover discrepancy.",
)
@click.option(
    "--dynamic",
    is_flag=True,
    help="DATA are a gear that moves: calibrate mass, damping and stiffness.",
)
@click.option(
    "--chains",
    type=click.IntRange(1, 64),
    default=4,
    show_default=True,
    help="Independent chains.",
)
@click.option(
    "--warmup",
    type=_MANY,
    default=1000,
    show_default=True,
    help="Iterations of adaptation per chain.",
)
@click.option(
    "--draws", type=_MANY, default=1000, show_default=True, help="Draws kept per chain."
)
@seed_option
@click.option(
    "--out", metavar="DIR", help="Result folder to make [default: NAME-calibration]."
)
@force_option
@json_option
@click.pass_obj
def calibrate(console: Console, data, gear, columns, theory, out, force, **settings):
    """Calibrate the force model against DATA and write a result folder.

    With --dynamic the rows are a time series (time_s, deformation_mm, force_N) of one
    gear set in motion, and mass, damping and stiffness are calibrated.
    """
    from hdcal.report.folder import check_target

    findings = []
    dynamic = settings.pop("dynamic")
    if dynamic:
        findings += _not_dynamic(settings)
    case = read_given(console, data, gear, columns, theory)
    findings += console.wrong
    # Said now, not after minutes of sampling.
    target = out if out is not None else f"{case.name if case else 'x'}-calibration"
    if case is not None or out is not None:
        try:
            check_target(target, force=force)
        except InputError as error:
            findings += error.findings
    if findings or case is None:
        raise InputError(findings)
    if dynamic:
        return _calibrate_dynamic(console, case, theory, settings, target, force)
    return _calibrate(console, case, theory, settings, target, force)


def _not_dynamic(settings: dict) -> list[Finding]:
    """Take the options that --dynamic has no use for, and say so where they are set."""
    found = []
    for name, option in (("effects", "--effect"), ("with_gap", "--with-gap")):
        if settings.pop(name):
            words = "does not go with --dynamic, whose model is linear"
            found.append(Finding(option, words, "Leave it out"))
    return found


def _calibrate_dynamic(console: Console, case, theory, settings, target, force) -> int:
    keep_compilations()
    from hdcal.cli.progress import progress_bar
    from hdcal.motion.dynamic_calibration import calibrate_dynamic
    from hdcal.motion.result_folder import write_motion
    from hdcal.motion.terminal import motion_words

    for note in case.notes:
        console.words(note)
    with progress_bar() as progress:
        posterior = calibrate_dynamic(
            case, theory=theory, progress=progress, **settings
        )
    command = shlex.join(["hdcal", *sys.argv[1:]])
    summary = write_motion(posterior, target, command=command, force=force)
    console.table(*motion_words(summary, str(target)))
    if console.json:
        console.data(summary)
    return 0 if summary["status"] == "ok" else 1


def _calibrate(console: Console, case, theory, settings, target, force) -> int:
    keep_compilations()
    from hdcal.calibration.calibrate import calibrate as run
    from hdcal.calibration.calibrate import choose_effects
    from hdcal.calibration.result_folder import write_result
    from hdcal.calibration.terminal import closing_words
    from hdcal.cli.progress import progress_bar

    choose_effects(settings["effects"])
    for note in case.notes:
        console.words(note)
    with progress_bar() as progress:
        posterior = run(case, theory=theory, progress=progress, **settings)
    command = shlex.join(["hdcal", *sys.argv[1:]])
    summary = write_result(posterior, target, command=command, force=force)
    console.table(*closing_words(summary, str(target)))
    if console.json:
        console.data(summary)
    return 0 if summary["status"] == "ok" else 1
