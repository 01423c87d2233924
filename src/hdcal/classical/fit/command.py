"""`hdcal fit`: polynomials by least squares, as a curve-fitting tool gives them."""

import shlex
import sys

import click

from hdcal.cli.console import Console
from hdcal.cli.options import (
    case_options,
    force_option,
    json_option,
    read_columns,
)
from hdcal.errors import Finding, InputError


@click.command(short_help="Classical polynomial fits, with their errors.")
@case_options
@click.option(
    "--degree",
    "degrees",
    default="1,2,3",
    show_default=True,
    metavar="LIST",
    help="Degrees of the polynomials, 1 to 9.",
)
@click.option(
    "--through-origin",
    is_flag=True,
    help="Only curves without intercept [default: each with and without].",
)
@click.option(
    "--at",
    type=float,
    metavar="MM",
    help="Compare forces at this deformation [default: the gear's nominal one].",
)
@click.option(
    "--run",
    metavar="RUN",
    help="Show the answer of a calibration of the same data beside the curves.",
)
@click.option("--out", metavar="DIR", help="Also write a folder with a report.")
@force_option
@json_option
@click.pass_obj
def fit(console: Console, data, gear, columns, theory, out, force, **wanted):
    """Fit polynomials of force over deformation to DATA by least squares.

    For who knows polyfit: the same coefficients, with standard errors, confidence
    intervals, and tests of whether the curve suits the data.
    """
    from hdcal.classical.fit.fit import fit as fit_case
    from hdcal.classical.fit.summary import summarise_fits
    from hdcal.data.reading import read_case
    from hdcal.report.folder import check_target

    findings, case, fits = [], None, ()
    try:
        case = read_case(data, gear, columns=read_columns(columns), theory=theory)
    except InputError as error:
        findings += error.findings
    try:
        degrees = _read_degrees(wanted["degrees"])
        if case is not None:
            fits = fit_case(case, degrees, through_origin=wanted["through_origin"])
    except InputError as error:
        findings += error.findings
    if out is not None:
        try:
            check_target(out, force=force)
        except InputError as error:
            findings += error.findings
    if findings or case is None:
        raise InputError(findings)
    posterior = _load(wanted["run"])
    found = summarise_fits(case, fits, at=wanted["at"], posterior=posterior)
    _show(console, case, fits, found, out, force)
    return 0


def _read_degrees(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        words = f"'{text[:60]}' is no list of whole numbers"
        finding = Finding("--degree", words, "Write it like 1,3")
        raise InputError([finding]) from None


def _load(run: str | None):
    if run is None:
        return None
    from hdcal.cli.compilation_cache import keep_compilations
    from hdcal.inference.posterior import Posterior

    keep_compilations()
    posterior = Posterior.load(run)
    posterior.require_usable()
    return posterior


def _show(console: Console, case, fits, found: dict, out, force: bool) -> None:
    from hdcal.classical.fit.document import fit_sheet
    from hdcal.report.sheet import sheet_words

    console.table(*sheet_words(fit_sheet(found)))
    if out is not None:
        from hdcal.classical.fit.result_folder import write_fits

        command = shlex.join(["hdcal", *sys.argv[1:]])
        write_fits(case, fits, found, out, command=command, force=force)
        console.words(f"the result: {out}  (open report.html)")
    if console.json:
        console.data(found)
