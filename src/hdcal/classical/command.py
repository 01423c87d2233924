"""`hdcal fit`: polynomials by least squares."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.option_types import LENGTH, NUMBERS
from hdcal.cli.options import case_options, json_option, out_option, read_given


@command(short_help="Fit polynomials by least squares.")
@case_options
@click.option(
    "--degree",
    "degrees",
    type=NUMBERS,
    default="1,2,3",
    show_default=True,
    help="Fit these degrees, 1 to 9, each with and without an intercept.",
)
@click.option(
    "--at",
    type=LENGTH,
    help="Compare forces at this deformation [default: the nominal one].",
)
@out_option
@json_option
@click.pass_obj
def fit(console: Console, degrees, at, out, force, **given):
    """Fit polynomials of force over deformation to DATA by least squares.

    The coefficients are those of polyfit, with standard errors and confidence
    intervals.
    """
    from hdcal.classical.fit import fit as fit_case

    with console.wrong:
        case = read_given(console, **given)
        console.reserve_folder(out, force)
    assert case is not None
    found = fit_case(case, degrees, at=at)
    return console.show(found, answer="fit.json")
