"""`hdcal fit`: polynomials by least squares, as a curve-fitting tool gives them."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import LENGTH, WHOLE_NUMBERS
from hdcal.cli.options import case_options, json_option, out_option, read_given


@command(short_help="Classical polynomial fits, with their errors.")
@case_options
@click.option(
    "--degree",
    "degrees",
    type=WHOLE_NUMBERS,
    default="1,2,3",
    show_default=True,
    help="Degrees of the polynomials, 1 to 9.",
)
@click.option(
    "--through-origin",
    is_flag=True,
    help="Only curves without intercept [default: each with and without].",
)
@click.option(
    "--at",
    type=LENGTH,
    help="Compare forces at this deformation [default: the gear's nominal one].",
)
@click.option(
    "--run",
    metavar="RUN",
    help="Show the answer of a calibration of the same data beside the curves.",
)
@out_option
@json_option
@click.pass_obj
def fit(console: Console, degrees, through_origin, at, run, out, force, **given):
    """Fit polynomials of force over deformation to DATA by least squares.

    For who knows polyfit: the same coefficients, with standard errors, confidence
    intervals, and tests of whether the curve suits the data.
    """
    from hdcal.classical.fit.fit import fit as fit_case
    from hdcal.classical.fit.summary import fit_report
    from hdcal.cli.sources import load_usable

    with console.wrong as wrong:
        case = read_given(console, **given)
        fits = None
        if case is not None and degrees is not None:
            fits = wrong.attempt(fit_case, case, degrees, through_origin=through_origin)
        console.reserve_folder(out, force)
    assert case is not None and fits is not None
    posterior = None if run is None else load_usable(run)
    told = fit_report(case, fits, console.command, at=at, posterior=posterior)
    return console.report(told)
