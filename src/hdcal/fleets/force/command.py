"""`hdcal margin` of whatever was measured: of the models of a gear, or of a fleet."""

from collections.abc import Iterator, Mapping
from typing import Any

import click

from hdcal.cli.command import Command
from hdcal.cli.console import Console
from hdcal.cli.option_types import unit_findings
from hdcal.cli.options import is_given
from hdcal.errors import Finding
from hdcal.prediction.margin.command import margin as of_models

# What a fleet has one answer for, and why; and what none of it is told for.
_FIXED = {
    "quantity": ("reading", "a fleet is told as the gauge shows it"),
    "population": ("specimens", "a fleet tells of gears to come, on new mountings"),
    "direction": ("up", "a fleet's lines are the same up and down"),
}
_NOT_TOLD = {
    "temperature": "a fleet is told at its reference temperature",
    "given_force": "of a fleet forces are told, not the deformations they reach",
    "required_probability": "of a fleet the capacity that a share keeps is its bound",
    "tolerances": "how much gears differ is in the scatter of the fleet",
    "rule": "nothing is decided of a fleet: it tells which share needs more",
    "certificate": "there is none of a fleet",
}
_REMEDIES = {"required_probability": "Ask for that share as `content`"}


@click.pass_context
def _margin(context: click.Context, run: str, **asked):
    from hdcal.inference.posterior_file import FLEET, kind_of

    if kind_of(run) is FLEET:
        return _of_fleet(context.obj, run, **asked)
    assert of_models.callback is not None
    return context.invoke(of_models.callback, run=run, **asked)


def _of_fleet(console: Console, run: str, out, force, deformation, **asked):
    from hdcal.fleets.fleet_posterior import FleetPosterior
    from hdcal.fleets.force.summary import force_report

    found = None
    with console.wrong as wrong:
        posterior = wrong.attempt(FleetPosterior.load, run)
        console.reserve_folder(out, force)
        wrong += _without_answer(asked)
        if posterior is not None:
            wrong += _other_seed(asked["seed"], posterior.facts.settings.seed)
            how: dict[str, Any] = {"confidence": asked["confidence"]}
            how |= {"content": asked["content"]} if is_given("content") else {}
            limit, units = asked["limit_force"], posterior.facts.quantities
            wrong += unit_findings(units, deformation=deformation, limit_force=limit)
            # What is no number was told while the options were read.
            if deformation is not None:
                found = wrong.attempt(posterior.next_force, deformation, limit, **how)
    assert posterior is not None and found is not None
    return console.report(force_report(found, posterior.facts, console.command))


def _without_answer(asked: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield a finding for each option that a fleet has no answer to."""
    for name, (told, words) in _FIXED.items():
        if is_given(name) and asked[name] != told:
            yield Finding(name, words, f"Leave it out, or say {told}")
    for name, words in _NOT_TOLD.items():
        if is_given(name):
            yield Finding(name, words, _REMEDIES.get(name, "Leave it out"))


def _other_seed(given: int, own: int) -> Iterator[Finding]:
    if is_given("seed") and given != own:
        words = f"this fleet was drawn with the seed {own}, which counts here too"
        yield Finding("seed", words, "Leave it out, or ask for the fleet again with it")


margin = Command(
    "margin",
    callback=_margin,
    params=of_models.params,
    help=of_models.help,
    short_help=of_models.short_help,
    context_settings=of_models.context_settings,
)
