"""`hdcal effects`: the library as a table."""

import click

from hdcal.cli.console import Console
from hdcal.cli.options import json_option

SCHEMA = "hdcal.effects/1"


@click.command(short_help="List the library of effects.")
@json_option
@click.pass_obj
def effects(console: Console):
    """List the effects that `hdcal calibrate --effect NAME` can include."""
    listed = _describe()
    console.table(_table(listed))
    if console.json:
        console.data({"schema": SCHEMA, "status": "ok", "effects": listed})
    return 0


def _describe() -> list[dict]:
    from hdcal.data.priors import effect_priors
    from hdcal.physics.effect import parameters
    from hdcal.physics.registry import EFFECTS
    from hdcal.report.words import prior_words

    priors = effect_priors()

    def describe(name: str, site: str, declared) -> dict:
        prior = priors.get(site)
        return {
            "name": name,
            "unit": declared.unit,
            "meaning": declared.meaning,
            "null": declared.null,
            "prior": prior and prior_words(site, prior),
            "source": prior and prior.source,
        }

    return [
        {
            "name": name,
            "stage": effect.stage,
            "family": effect.family,
            "needs": sorted(effect.needs),
            "meaning": (effect.__doc__ or "").strip().split("\n")[0],
            "parameters": [
                describe(field, f"{name}.{field}", declared)
                for field, declared in parameters(effect).items()
            ],
        }
        for name, effect in EFFECTS.items()
    ]


def _table(listed: list[dict]):
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("effect", no_wrap=True)
    for heading in ("stage", "needs", "parameter", "meaning", "prior"):
        table.add_column(heading)
    for effect in listed:
        first = [effect["name"], effect["stage"], ", ".join(effect["needs"]) or "–"]
        for item in effect["parameters"]:
            prior = item["prior"] or "none shipped"
            row = [*first, item["name"], item["meaning"], prior]
            table.add_row(*(Text(text) for text in row))
            first = ["", "", ""]
    return table
