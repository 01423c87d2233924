"""`hdcal design`: the spring of a wave generator, or the sizes that keep a limit."""

import shlex
import sys
from functools import partial

import click

from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.findings import options_named
from hdcal.cli.options import force_option, json_option, seed_option
from hdcal.cli.quantities import (
    names_in,
    read_ends,
    read_list,
    read_millimetres,
    read_named,
    read_quantity,
    read_temperatures,
)
from hdcal.errors import Finding, InputError, attempt

_OF_WINDOW = ("setting_sd", "spring_rate")
_OF_LIMIT = ("deformation", "vary", "material", "limit_stress")
# Parameters of the library that an option has another name for.
_OTHER_NAMES = {
    "materials": "--material",
    "rates": "--spring-rate",
    "temperatures": "--temperature",
    "tolerances": "--tolerance",
}


@click.command(short_help="Wave generator for a window, or sizes for a limit.")
@click.argument("run", metavar="RUN", required=False)
@click.option(
    "--gear", metavar="GEAR.toml", help="Without RUN: a gear of which priors are known."
)
@click.option(
    "--window",
    metavar="LO:HI",
    help="Deformation to keep [mm]: backlash below, jam above. Asks for a spring.",
)
@click.option(
    "--setting-sd", metavar="MM", help="Scatter of the spring's set point as built."
)
@click.option(
    "--spring-rate",
    metavar="LO:HI",
    help="Spring rates to look at [N/mm] [default: 0.01 to 100 times the gear].",
)
@click.option(
    "--limit-force", metavar="N", help="Force not to be exceeded. Asks for sizes."
)
@click.option(
    "--limit-stress",
    metavar="MPA",
    help="Hoop stress not to be exceeded [default: the yield strength].",
)
@click.option(
    "--deformation", metavar="MM", help="At which the limit holds [default: nominal]."
)
@click.option(
    "--vary",
    metavar="SIZE_mm=LO:HI",
    multiple=True,
    help="A size that may change: wall_thickness_mm=0.5:0.8; may be repeated.",
)
@click.option(
    "--material",
    metavar="NAME",
    multiple=True,
    help="Materials to choose among [default: the gear's].",
)
@click.option(
    "--temperature",
    metavar="LO:HI",
    help="Temperatures at which it has to hold [°C] [default: the reference one].",
)
@click.option(
    "--probability",
    type=float,
    default=0.99,
    show_default=True,
    help="With which it has to hold.",
)
@click.option(
    "--tolerance",
    metavar="SIZE_mm=±",
    multiple=True,
    help="Tolerance of a size: wall_thickness_mm=0.02; may be repeated.",
)
@seed_option
@click.option("--out", metavar="DIR", help="Result folder [default: NAME-design].")
@force_option
@json_option
@click.pass_obj
def design(console: Console, run, gear, out, force, **given):
    """Design from RUN, a folder of `hdcal calibrate`.

    With --window: the softest spring of an elastic wave generator that keeps the gear
    inside. With --limit-force: the sizes nearest to the tested ones that keep it.
    """
    keep_compilations()
    from hdcal.design.checks import name_findings
    from hdcal.design.sources import open_source
    from hdcal.prediction.engine.sizes import SIZES
    from hdcal.report.folder import check_target

    findings = _one_question(given)
    asked = _read(findings, given)
    for option in ("vary", "tolerance"):
        names = names_in(given[option])
        findings += name_findings(names, SIZES, f"--{option}")
    source, target = open_source(findings, run, gear, out, "design")
    if target is not None:
        attempt(findings, lambda: check_target(target, force=force))
    if findings:
        raise InputError(findings)
    return _design(console, source, asked, given["window"] is not None, target, force)


def _one_question(given: dict) -> list[Finding]:
    window, limit = given["window"] is not None, given["limit_force"] is not None
    if window == limit:
        words = "both ask at once" if window else "nothing is asked"
        remedy = "Say either --window LO:HI or --limit-force N"
        return [Finding("--window and --limit-force", words, remedy)]
    foreign = _OF_LIMIT if window else _OF_WINDOW
    mode = "--window" if window else "--limit-force"
    return [
        Finding(
            "--" + name.replace("_", "-"),
            f"has no meaning with {mode}",
            "leave it out",
        )
        for name in foreign
        if given[name]
    ]


def _read(findings: list[Finding], given: dict) -> dict:
    read = partial(attempt, findings)

    def number(name: str, unit: str):
        option = "--" + name.replace("_", "-")
        text = given[name]
        return None if text is None else read(read_quantity, text, unit, option)

    def ends(name: str):
        option = "--" + name.replace("_", "-")
        return None if given[name] is None else read(read_ends, given[name], option)

    warmth = given["temperature"]
    common = {
        "probability": given["probability"],
        "seed": given["seed"],
        "temperatures": None if warmth is None else read(read_temperatures, warmth),
        "tolerances": read(
            read_named, given["tolerance"], "--tolerance", read_millimetres
        ),
    }
    if given["window"] is not None:
        return {
            **common,
            "window": ends("window"),
            "rates": ends("spring_rate"),
            "setting_sd": number("setting_sd", "mm") or 0.0,
        }
    return {
        **common,
        "limit_force": number("limit_force", "N"),
        "limit_stress": number("limit_stress", "MPa"),
        "deformation": number("deformation", "mm"),
        "vary": read(read_named, given["vary"], "--vary", read_ends),
        "materials": read_list(given["material"]),
    }


def _design(console: Console, source, asked, spring: bool, target, force) -> int:
    from hdcal.design.inverse_design import inverse_design
    from hdcal.design.result_folder import write_generator, write_inverse
    from hdcal.design.terminal import closing_words
    from hdcal.design.wave_generator import wave_generator

    made = {"command": shlex.join(["hdcal", *sys.argv[1:]]), "force": force}
    with options_named(**_OTHER_NAMES):
        if spring:
            told = write_generator(wave_generator(source, **asked), target, **made)
        else:
            told = write_inverse(inverse_design(source, **asked), target, **made)
    console.table(*closing_words(told, str(target)))
    if console.json:
        console.data(told)
    return 0
