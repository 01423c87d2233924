"""`hdcal margin`: the force that a deformation needs, and the margin to it."""

import shlex
import sys

import click

from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.findings import options_named
from hdcal.cli.options import (
    direction_option,
    force_option,
    json_option,
    read_window,
    seed_option,
)
from hdcal.cli.quantities import read_millimetres, read_named
from hdcal.errors import Finding, InputError


@click.command(short_help="Force needed at a deformation, and the margin to it.")
@click.argument("run", metavar="RUN")
@click.option(
    "--deformation", type=float, required=True, help="Deformation as read [mm]."
)
@click.option("--limit-force", type=float, help="Capacity of the actuator [N].")
@click.option(
    "--given-force", type=float, help="Force [N] whose deformation is asked for."
)
@click.option(
    "--temperature",
    metavar="FROM:TO",
    help="Window -20:80, or a list 20,60 [°C] [default: the tested one].",
)
@click.option(
    "--content",
    type=float,
    default=0.99,
    show_default=True,
    help="Share of the population within each bound.",
)
@click.option(
    "--confidence",
    type=float,
    default=0.95,
    show_default=True,
    help="Confidence of each bound.",
)
@click.option(
    "--required-probability",
    type=float,
    help="Share of the population that a capacity has to hold [default: --content].",
)
@click.option(
    "--population",
    metavar="WHOSE",
    help="readings, mountings or specimens [default: the widest that was tested].",
)
@click.option(
    "--quantity",
    type=click.Choice(["reading", "load"]),
    default="reading",
    show_default=True,
    help="What the gauge shows, or what acts on the gear.",
)
@direction_option
@click.option(
    "--tolerance",
    "tolerances",
    metavar="SIZE_mm=±",
    multiple=True,
    help="Tolerance of a size: wall_thickness_mm=0.02; may be repeated.",
)
@seed_option
@click.option("--out", metavar="DIR", help="Write a result folder with a report.")
@force_option
@json_option
@click.pass_obj
def margin(console: Console, run, temperature, tolerances, out, force, **asked):
    """Bound the force needed at a deformation, from RUN.

    RUN is a folder of `hdcal calibrate` or `hdcal diagnose`; causes that the latter
    could not tell apart are averaged over by their probability.
    """
    findings: list[Finding] = []
    window, sizes = None, {}
    try:
        window = None if temperature is None else read_window(temperature)
    except InputError as error:
        findings += error.findings
    try:
        sizes = read_named(tolerances, "--tolerance", read_millimetres)
    except InputError as error:
        findings += error.findings
    if out is not None:
        from hdcal.report.folder import check_target

        try:
            check_target(out, force=force)
        except InputError as error:
            findings += error.findings
    return _margin(console, run, window, sizes, asked, findings, out, force)


def _margin(console: Console, run, window, sizes, asked, findings, out, force) -> int:
    keep_compilations()
    from hdcal.prediction.engine.causes import read_models
    from hdcal.prediction.margin.margin import margin as bounds_of
    from hdcal.prediction.margin.result_folder import margin_json, write_margin
    from hdcal.prediction.margin.terminal import closing_words

    try:
        models = read_models(run)
    except InputError as error:
        raise InputError([*findings, *error.findings]) from error
    if findings:
        raise InputError(findings)
    with options_named():
        found = bounds_of(models, temperature=window, tolerances=sizes, **asked)
    posterior = max(models, key=lambda model: model[0])[1]
    plain = margin_json(found, posterior, seed=asked["seed"])
    if out is not None:
        command = shlex.join(["hdcal", *sys.argv[1:]])
        write_margin(found, posterior, plain, out, command=command, force=force)
    console.table(*closing_words(plain, out))
    if console.json:
        console.data(plain)
    return 0
