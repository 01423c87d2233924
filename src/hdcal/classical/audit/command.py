"""`hdcal audit`: the article's claims against its own formula and readings."""

import click

from hdcal.cli.command import command
from hdcal.cli.console import Console
from hdcal.cli.options import json_option, out_option


@command(short_help="The article's claims against its own numbers.")
@out_option
@json_option
@click.pass_obj
def audit(console: Console, out, force):
    """Check each claim of the article whose gear and data hdcal bundles.

    Everything is computed here, from its formula and its Table 2; only what the
    article itself prints is given.
    """
    with console.wrong:
        console.reserve_folder(out, force)
    from hdcal.classical.audit.audit import audit as check_claims
    from hdcal.classical.audit.document import audit_document
    from hdcal.classical.audit.summary import audit_answer
    from hdcal.report.write import Report

    found = audit_answer(check_claims())
    told = Report(audit_document(found), found, "audit.json")
    return console.report(told)
