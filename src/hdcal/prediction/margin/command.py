"""`hdcal margin`: the force that a deformation needs, and the margin to it."""

from datetime import date

import click

from hdcal.cli import options
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import FORCE, LENGTH, WINDOW, unit_findings
from hdcal.errors import Finding


@command(
    short_help="Force needed at a deformation, and the margin to it.",
    context_settings={"show_default": True},
)
@click.argument("run", metavar="RUN")
@click.option(
    "--deformation", type=LENGTH, required=True, help="Deformation as read [mm]."
)
@click.option(
    "--limit-force",
    type=FORCE,
    help="Capacity of the actuator [N]: its size, in compression and in tension.",
)
@click.option(
    "--rule",
    type=click.Choice(["guarded", "simple"]),
    help="Decide by the expanded uncertainty or not [default: guarded].",
)
@click.option(
    "--given-force",
    type=FORCE,
    help="Force with its sign [N]: give the deformation that it reaches.",
)
@click.option(
    "--temperature",
    type=WINDOW,
    help="Window -20:80, or a list 20,60 [°C] [default: the tested one].",
)
@click.option(
    "--content", default=0.99, help="Share of the population within each bound."
)
@click.option("--confidence", default=0.95, help="Confidence of each bound.")
@click.option(
    "--population",
    metavar="WHOSE",
    help="readings, mountings or specimens [default: the widest that was tested].",
)
@click.option(
    "--quantity",
    type=click.Choice(["reading", "load"]),
    default="reading",
    help="Reading of the gauge, or load on the gear.",
)
@options.direction_option("Loading or unloading, in compression and in tension.")
@options.tolerance_option
@options.seed_option
@options.folder_options("Write a result folder with a report.")
@options.json_option
@click.option(
    "--certificate",
    is_flag=True,
    help="Write a certificate to sign, one A4 page, too.",
)
@click.pass_obj
def margin(console: Console, run, out, force, certificate, **asked):
    """Bound the force needed at a deformation, from RUN.

    RUN is a folder of `hdcal calibrate` or `hdcal diagnose`; causes that the latter
    could not separate are averaged over by their probability. From a folder of `hdcal
    fleet` it bounds what the next gears need.
    """
    from hdcal.inference.model_average import load_models
    from hdcal.prediction.margin.margin import margin as bounds_of
    from hdcal.prediction.models import model_pairs

    with console.wrong as wrong:
        models = wrong.attempt(load_models, run)
        console.reserve_folder(out, force)
        if certificate and out is None:
            words = "is written into a result folder"
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
