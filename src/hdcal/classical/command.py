"""`hdcal fit`: polynomials by least squares."""

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
    "posterior",
    metavar="RUN",
    help="Compare with a calibration of the same data.",
)
@out_option
@json_option
@click.pass_obj
def fit(console: Console, degrees, through_origin, at, posterior, out, force, **given):
    """Fit polynomials of force over deformation to DATA by least squares.

    The coefficients are those of polyfit, with standard errors, confidence intervals,
    and tests of whether the curve suits the data.
    """
    from hdcal.classical.fit import fit as fit_case
    from hdcal.cli.sources import load_usable

    found = None
    with console.wrong as wrong:
        asked = {"through_origin": through_origin, "at": at}
        case = read_given(console, **given)
        if posterior is not None:
            asked["posterior"] = wrong.attempt(load_usable, posterior)
        console.reserve_folder(out, force)
        if case is not None and degrees is not None:
            found = wrong.attempt(fit_case, case, degrees, **asked)
    assert found is not None
    return console.show(found, answer="fit.json")
