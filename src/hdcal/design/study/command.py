"""`hdcal study`: the force on gears of many sizes, with its bands."""

import shlex
import sys

import click

from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.findings import options_named
from hdcal.cli.options import force_option, json_option, read_grid, seed_option
from hdcal.cli.quantities import (
    names_in,
    read_list,
    read_named,
    read_quantity,
)
from hdcal.errors import Finding, InputError, attempt


@click.command(short_help="Force over sizes and materials, with bands.")
@click.argument("run", metavar="RUN", required=False)
@click.option(
    "--gear", metavar="GEAR.toml", help="Without RUN: a gear of which priors are known."
)
@click.option(
    "--vary",
    metavar="NAME=VALUES",
    multiple=True,
    help="wall_thickness_mm=0.6:0.76:5 or radius_mm=35,40,45; may be repeated. Also "
    "length_mm, load_height_mm, deformation_mm, temperature_C.",
)
@click.option(
    "--material",
    metavar="NAME",
    multiple=True,
    help="Materials to compare [default: the gear's].",
)
@click.option("--deformation", metavar="MM", help="Radial [default: nominal].")
@click.option(
    "--temperature", type=float, metavar="C", help="[default: the reference one]"
)
@click.option(
    "--article",
    is_flag=True,
    help="Print the article's Tables 3 and 4 beside consistent values instead.",
)
@seed_option
@click.option("--out", metavar="DIR", help="Result folder [default: NAME-study].")
@force_option
@json_option
@click.pass_obj
def study(console: Console, run, gear, article, out, force, **given):
    """Compute the force for every combination of sizes, from RUN.

    RUN is a folder of `hdcal calibrate`.
    """
    from hdcal.design.sources import open_source
    from hdcal.report.folder import check_target

    keep_compilations()
    if article:
        return _article(console, run, gear, out, given)
    from hdcal.design.checks import name_findings
    from hdcal.design.study.study import AXES

    findings: list[Finding] = []
    asked = _read(findings, given)
    names = names_in(given["vary"])
    findings += name_findings(names, AXES, "--vary")
    source, target = open_source(findings, run, gear, out, "study")
    if target is not None:
        attempt(findings, lambda: check_target(target, force=force))
    if findings:
        raise InputError(findings)
    return _study(console, source, asked, target, force)


def _read(findings: list[Finding], given: dict) -> dict:
    text = given["deformation"]
    if not given["vary"] and not given["material"]:
        words, remedy = "nothing is varied", "Say --vary wall_thickness_mm=0.6:0.76:5"
        findings.append(Finding("--vary", words, remedy))
    return {
        "vary": attempt(findings, read_named, given["vary"], "--vary", read_grid),
        "materials": read_list(given["material"]),
        "deformation": None
        if text is None
        else attempt(findings, read_quantity, text, "mm", "--deformation"),
        "temperature": given["temperature"],
        "seed": given["seed"],
    }


def _study(console: Console, source, asked, target, force) -> int:
    from hdcal.design.result_folder import write_study
    from hdcal.design.study.study import study as run_study
    from hdcal.design.terminal import closing_words

    command = shlex.join(["hdcal", *sys.argv[1:]])
    with options_named(materials="--material"):
        found = run_study(source, **asked)
    told = write_study(found, target, command=command, force=force)
    console.table(*closing_words(told, str(target)))
    if console.json:
        console.data(told)
    return 0


def _article(console: Console, run, gear, out, given: dict) -> int:
    foreign = {"gear": gear, "out": out, **given, "seed": None}
    findings = [
        Finding(f"--{name}", "has no meaning with --article", "leave it out")
        for name, value in foreign.items()
        if value
    ]
    if findings:
        raise InputError(findings)
    from hdcal.design.study.article_tables import article_rows
    from hdcal.design.summary import summarise_article
    from hdcal.design.terminal import article_words
    from hdcal.inference.posterior import Posterior

    posterior = None if run is None else Posterior.load(run)
    told = summarise_article(article_rows(posterior))
    console.table(*article_words(told))
    if console.json:
        console.data(told)
    return 0
