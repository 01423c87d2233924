"""`hdcal respond`: how a calibrated gear moves under a force."""

import shlex
import sys
from pathlib import Path

import click

from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.findings import options_named
from hdcal.cli.options import (
    json_option,
    read_columns,
    seed_option,
)
from hdcal.errors import Finding, InputError

_SHAPES = ("step", "sine", "chirp")


@click.command(short_help="How a calibrated gear moves under a force over time.")
@click.argument("run", metavar="RUN")
@click.option(
    "--force",
    "drive",
    required=True,
    metavar="F.csv|step|sine|chirp",
    help="The force on the gear: a table with time_s and force_N, or a shape.",
)
@click.option(
    "--amplitude",
    type=float,
    metavar="N",
    help="Of a shape [N] [default: 80].",
)
@click.option(
    "--frequency",
    metavar="HZ",
    help="Of a sine [Hz]: 5; of a chirp its first and last: 5:200.",
)
@click.option(
    "--duration", type=float, metavar="S", help="Of a shape [s] [default: 0.5]."
)
@click.option(
    "--temperature",
    type=float,
    metavar="C",
    help="Of the gear [°C] [default: the reference one, within what was tested].",
)
@click.option(
    "--mass-kg", type=float, metavar="KG", help="Moved mass, if known [default: prior]."
)
@click.option(
    "--damping",
    type=float,
    metavar="C",
    help="Damping c, if known [N·s/mm] [default: prior].",
)
@click.option(
    "--points", type=int, default=1001, show_default=True, help="Times to answer at."
)
@click.option(
    "--draws", type=int, default=500, show_default=True, help="Gears to integrate."
)
@click.option(
    "--column",
    "columns",
    metavar="QUANTITY=HEADER",
    multiple=True,
    help="Read a quantity of F.csv from a header of your own: force=Load[kgf].",
)
@seed_option
@click.option(
    "--out", metavar="DIR", help="Result folder to make [default: RUN-response]."
)
@click.option("--replace", is_flag=True, help="Replace an older result of hdcal.")
@json_option
@click.pass_obj
def respond(console: Console, run, drive, columns, frequency, out, replace, **asked):
    """Predict how the gear of RUN, a result folder, deforms under a force over time.

    Units: N, mm, s, Hz, kg, N·s/mm. Motion begins at rest.
    """
    from hdcal.data.force_table import read_force
    from hdcal.report.folder import check_target

    findings: list[Finding] = []
    target = out if out is not None else f"{Path(run).resolve().name}-response"

    def attempt(work, *arguments, **named):
        try:
            return work(*arguments, **named)
        except InputError as error:
            findings.extend(error.findings)
            return None

    attempt(check_target, target, force=replace, option="--replace")
    tones = None if frequency is None else attempt(_tones, frequency)
    headers = attempt(read_columns, columns) or {}
    force = drive if drive in _SHAPES else attempt(read_force, drive, headers)
    if force is not drive and asked["amplitude"] is not None:
        words = "a sampled force has its own"
        findings.append(Finding("--amplitude", words, "Leave it out"))
    if findings:
        raise InputError(findings)
    return _respond(console, run, force, tones, target, replace, asked)


def _tones(text: str) -> list[float]:
    """Read 5 or 5:200 as numbers.

    Raises:
        InputError: it is neither.
    """
    try:
        return [float(part) for part in text.split(":")]
    except ValueError:
        words = f"'{text[:60]}' is no frequency"
        remedy = "Write it like 5, or 5:200 for a chirp"
        raise InputError([Finding("--frequency", words, remedy)]) from None


def _respond(console: Console, run, force, tones, target, replace, asked) -> int:
    keep_compilations()
    from hdcal.inference.dynamic_posterior import load_any
    from hdcal.motion.respond.respond import respond as ask
    from hdcal.motion.result_folder import write_response
    from hdcal.motion.terminal import response_words

    posterior = load_any(run)
    mass, amplitude = asked.pop("mass_kg"), asked.pop("amplitude")
    with options_named(mass="--mass-kg"):
        response = ask(
            posterior,
            force,
            amplitude=80.0 if amplitude is None else amplitude,
            frequency=tones,
            # 1 kg = 1e-3 N·s²/mm.
            mass=None if mass is None else 1e-3 * mass,
            **asked,
        )
    command = shlex.join(["hdcal", *sys.argv[1:]])
    summary = write_response(
        response, posterior, target, command=command, force=replace
    )
    console.table(*response_words(summary, str(target)))
    if console.json:
        console.data({**summary, "columns": response.columns()})
    return 0
