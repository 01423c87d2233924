"""`hdcal margin` of a folder: of calibrated models, or of a fleet."""

import click

from hdcal.cli import options
from hdcal.cli.command import Command
from hdcal.cli.console import Console
from hdcal.cli.option_types import unit_findings
from hdcal.prediction.margin.command import margin as of_models

# Options without a meaning for a fleet: its lines are the same in both directions, and
# gears to come are those of its population, at the reference temperature.
_OTHERS = ("quantity", "population", "direction", "temperature", "given_force", "seed")
_OTHERS += ("tolerances", "rule", "certificate")


@click.pass_context
def _margin(context: click.Context, run: str, **asked):
    from hdcal.inference.posterior_file import FLEET, kind_of

    if kind_of(run) is FLEET:
        return _of_fleet(context.obj, run, **asked)
    assert of_models.callback is not None
    return context.invoke(of_models.callback, run=run, **asked)


def _of_fleet(console: Console, run: str, out, force, deformation, **asked):
    from hdcal.fleets.posterior import FleetPosterior

    found = None
    with console.wrong as wrong:
        posterior = wrong.attempt(FleetPosterior.load, run)
        console.reserve_folder(out, force)
        wrong += options.without_meaning(_OTHERS, "the result of a fleet")
        if posterior is not None:
            shares = {"confidence": asked["confidence"]}
            if options.is_given("content"):
                shares["content"] = asked["content"]
            limit, units = asked["limit_force"], posterior.units
            wrong += unit_findings(units, deformation=deformation, limit_force=limit)
            # A text that is no number was refused while the options were read.
            if deformation is not None:
                found = wrong.attempt(posterior.margin, deformation, limit, **shares)
    assert found is not None
    return console.show(found, answer="margin.json")


margin = Command(
    "margin",
    callback=_margin,
    params=of_models.params,
    help=of_models.help,
    short_help=of_models.short_help,
    context_settings=of_models.context_settings,
)
