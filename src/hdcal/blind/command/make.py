"""`hdcal blind make`: cases drawn from a mix, or one measurement, under seal."""

import os
import secrets
from pathlib import Path
from typing import Any

import click

from hdcal.blind.command.forms import check_forms
from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import force_option, json_option
from hdcal.errors import said_if_interrupted

# With fewer somebody could draw the cases of every seed and look which ones fit.
_SEED_BITS = 128
_HELP = {
    "seed": "Of the draws; it has to stay secret [default: random].",
    "program": "Let every case go through what this measurement did [default: the "
    "mix's].",
    "cause": "What is known to be behind it; 'unknown' for what no library holds.",
}


@command(short_help="Make a set of sealed cases.")
@click.option("--cases", type=int, help="How many to draw.")
@click.option("--mix", metavar="NAME", help="What to draw them from.")
@click.option("--seed", type=int, help=_HELP["seed"])
@click.option("--program", metavar="CSV", help=_HELP["program"])
@click.option("--from", "source", metavar="CSV", help="Seal a measurement instead.")
@click.option("--gear", metavar="GEAR.toml", help="Its gear file.")
@click.option("--cause", metavar="NAME[,NAME]", help=_HELP["cause"])
@click.option(
    "--withhold", metavar="NAME[,NAME]", help="Effects it is answered without."
)
@click.option("--out", metavar="DIR", required=True, help="Set to make.")
@click.option("--key", metavar="FILE", help="Key to write [default: DIR.key].")
@force_option
@json_option
@click.pass_obj
def make(console: Console, source, out, key, force, **given) -> None:
    """Seal cases drawn from a mix, or one measurement with a stated cause."""
    check_forms(real=source is not None)
    from hdcal.blind.answer import SetAnswer
    from hdcal.blind.sealed_set import write_set

    key = Path(os.path.realpath(out) + ".key" if key is None else key)
    content = _drawn(**given) if source is None else _measured(source, **given)
    manifest = write_set(out, key=key, force=force, **content)
    with said_if_interrupted(f"{out} is written"):
        console.result(f"commitment {manifest.commitment}")
        words = f"{len(manifest.cases)} sealed: {out}; keep the key to them: {key}"
        console.words(words)
        if console.json:
            next_step = f"Answer them: hdcal blind answer {out}"
            said = {"headline": words, "next_step": next_step}
            console.data(SetAnswer(status="ok", reasons=(), **said, **manifest.plain()))


def _drawn(mix, cases, seed, program, **_) -> dict[str, Any]:
    from hdcal.blind.sealed_measurement import loading_at
    from hdcal.blind.virtual_rig.cases import draw_cases, gear_file

    seed = secrets.randbits(_SEED_BITS) if seed is None else seed
    loading = None if program is None else loading_at(program)
    drawn = draw_cases(mix, cases, seed, loading)
    return {"drawn": drawn, "gear": gear_file(mix), "mix": mix, "seed": seed}


def _measured(source, gear, cause, withhold, **_) -> dict[str, Any]:
    from hdcal.blind.sealed_measurement import sealed_measurement

    table, gear, material, label = sealed_measurement(
        source, gear=gear, cause=cause, withhold=withhold
    )
    return {"drawn": [(table, label)], "gear": gear, "material": material}
