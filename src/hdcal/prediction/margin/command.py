"""`hdcal margin`: the force that a deformation needs, and the margin to it."""

from datetime import date

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE, LENGTH, WINDOW, unit_findings
from hdcal.errors import Finding


@command(
    short_help="Bound the force at a deformation.",
    context_settings={"show_default": True},
)
@click.argument("run", metavar="RUN")
@click.option(
    "--deformation",
    type=LENGTH,
    required=True,
    help="Bound the force at this deformation, as read [mm], or angle [rad].",
)
@click.option(
    "--limit-force",
    type=FORCE,
    help="Compare with this capacity of the actuator [N], by its magnitude.",
)
@click.option(
    "--rule",
    type=click.Choice(["guarded", "simple"]),
    help="Decide with a guard band or without [default: guarded].",
)
@click.option(
    "--given-force",
    type=FORCE,
    help="Bound the deformation at this force [N].",
)
@click.option(
    "--temperature",
    type=WINDOW,
    help="Bound over -20:80 or at 20,60 [°C] [default: the tested temperature].",
)
@click.option(
    "--content",
    default=0.99,
    help="Set the share of the population that keeps each bound.",
)
@click.option("--confidence", default=0.95, help="Set the confidence of each bound.")
@click.option(
    "--population",
    metavar="NAME",
    help="Bound readings, mountings or specimens (gears) [default: the widest "
    "population that was tested].",
)
@click.option(
    "--quantity",
    type=click.Choice(["reading", "load"]),
    default="reading",
    help="Bound the reading of the gauge, or the load on the gear.",
)
@options.direction_option("Bound the force on loading (up) or unloading (down).")
@options.tolerance_option
@options.seed_option
@options.folder_options("Write a result folder with a report to DIR.")
@options.json_option
@click.option(
    "--certificate",
    is_flag=True,
    help="Also write a certificate for signature, one A4 page; needs --out.",
)
@click.pass_obj
def margin(console: Console, run, out, force, certificate, **asked):
    """Compute bounds of the force at a deformation, from RUN.

    RUN is a result folder of `hdcal calibrate` or `diagnose`. Hypotheses of a diagnosis
    are averaged by their probability.
    """
    from hdcal.inference.model_average import load_models
    from hdcal.prediction.margin.margin import margin as bounds_of
    from hdcal.prediction.models import model_pairs

    with console.wrong as wrong:
        models = wrong.attempt(load_models, run)
        console.reserve_folder(out, force)
        if certificate and out is None:
            words = "needs a result folder"
            wrong.append(Finding("certificate", words, "Give `out` too"))
        if models is not None:
            units = model_pairs(models)[0][1].case.units
            names = "deformation", "limit_force", "given_force"
            wrong += unit_findings(units, **{name: asked[name] for name in names})
    assert models is not None
    found = bounds_of(models, **asked)
    others = {}
    if certificate:
        page = found.certificate(date.today())
        others["certificate.html"] = lambda: page.encode()
    return console.show(
        found,
        answer="margin.json",
        tables={"budget.csv": found.budget_frame()},
        others=others,
    )
