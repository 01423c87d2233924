"""`hdcal respond`: the motion of a calibrated gear under a force."""

from pathlib import Path

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.force_options import force_options, read_drive
from hdcal.cli.options import json_option, seed_option


@command(short_help="How a calibrated gear moves under a force over time.")
@click.argument("run", metavar="RUN")
@force_options
@click.option("--temperature", type=float, help="Of the gear [°C] [default: tested].")
@click.option("--mass-kg", "mass", type=float, help="Moved mass [default: prior].")
@click.option("--damping", type=float, help="Damping c [N·s/mm] [default: prior].")
@click.option("--points", default=1001, show_default=True, help="Times to answer at.")
@click.option("--draws", default=500, show_default=True, help="Gears to integrate.")
@seed_option
@click.option(
    "--out", metavar="DIR", help="Result folder to make [default: RUN-response]."
)
@click.option("--replace", is_flag=True, help="Replace an older result of hdcal.")
@json_option
@click.pass_obj
def respond(console: Console, run, force, columns, out, replace, **asked):
    """Predict how the gear of RUN, a result folder, deforms under a force over time.

    Units: N, mm, s, Hz, kg, N·s/mm. Motion begins at rest.
    """
    out = out if out is not None else f"{Path(run).resolve().name}-response"
    with console.wrong:
        console.reserve_folder(out, replace, "replace")
        drive = read_drive(console, force, columns, asked["amplitude"])
    from hdcal.inference.model_average import load_models
    from hdcal.motion.dynamic_problem import DynamicPosterior
    from hdcal.motion.respond import respond as compute

    if asked["mass"] is not None:
        asked["mass"] *= 1e-3  # 1 kg = 1e-3 N·s²/mm
    given = {name: value for name, value in asked.items() if value is not None}
    found = compute(load_models(run, [DynamicPosterior]), drive, **given)
    tables = {"response.csv": found.to_frame()}
    return console.show(found, answer="response.json", tables=tables)
