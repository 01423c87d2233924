"""`hdcal check`: read and validate, compute nothing."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import case_options, json_option, read_given


@command(short_help="Read DATA only, and say what was understood.")
@case_options
@json_option
@click.pass_obj
def check(console: Console, **given):
    """Read DATA and its gear file, and say what was understood."""
    with console.wrong:
        case = read_given(console, **given)
    assert case is not None
    from hdcal.calibration.check.document import check_document
    from hdcal.calibration.check.summary import check_answer

    found = check_answer(case)
    return console.answer(check_document(found), found)
