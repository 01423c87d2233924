"""`hdcal respond`: the motion of a calibrated gear under a force."""

from pathlib import Path

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE
from hdcal.cli.options import column_option, json_option, seed_option
from hdcal.errors import Finding


@command(short_help="Predict the motion of a gear under a force over time.")
@click.argument("run", metavar="RUN")
@click.option(
    "--force",
    required=True,
    metavar="F.csv|step",
    help="Apply this force: a table with time_s and force_N, or the word step.",
)
@column_option
@click.option(
    "--amplitude", type=FORCE, help="Set the amplitude of a step [N] [default: 80]."
)
@click.option(
    "--duration",
    type=float,
    metavar="S",
    help="Set the duration of a step [s] [default: 0.5].",
)
@click.option(
    "--temperature",
    type=float,
    help="Set the temperature of the gear [°C] [default: the tested temperature].",
)
@click.option(
    "--mass-kg",
    "mass",
    type=float,
    help="Set the moved mass [kg] [default: its prior].",
)
@click.option(
    "--damping", type=float, help="Set the damping c [N·s/mm] [default: its prior]."
)
@click.option(
    "--points", default=1001, show_default=True, help="Set the number of times."
)
@click.option(
    "--draws", default=500, show_default=True, help="Set the number of draws."
)
@seed_option
@click.option(
    "--out", metavar="DIR", help="Write the result to DIR [default: RUN-response]."
)
@click.option("--replace", is_flag=True, help="Replace an older result of hdcal.")
@json_option
@click.pass_obj
def respond(console: Console, run, force, columns, out, replace, **asked):
    """Predict the deformation over time of the gear of RUN, a result folder.

    Units are N, mm, s, kg, N·s/mm. The motion begins at rest.
    """
    from hdcal.data.measurements.measurements import read_force
    from hdcal.inference.model_average import load_models
    from hdcal.motion.dynamic_problem import DynamicPosterior
    from hdcal.motion.respond import STEP
    from hdcal.motion.respond import respond as compute

    out, drive = out or f"{Path(run).resolve().name}-response", force
    with console.wrong as wrong:
        console.reserve_folder(out, replace, "replace")
        if force != STEP:
            drive = wrong.attempt(read_force, force, columns or {})
            if asked["amplitude"] is not None:
                words = "is for a step only; the table states the force"
                wrong.append(Finding("amplitude", words, "Leave it out"))
    assert drive is not None
    if asked["mass"] is not None:
        asked["mass"] *= 1e-3  # 1 kg = 1e-3 N·s²/mm
    given = {name: value for name, value in asked.items() if value is not None}
    found = compute(load_models(run, [DynamicPosterior]), drive, **given)
    tables = {"response.csv": found.to_frame()}
    return console.show(found, answer="response.json", tables=tables)
