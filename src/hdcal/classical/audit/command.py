"""`hdcal audit`: the article's claims against its own formula and readings."""

import click

from hdcal.cli.console import Console
from hdcal.cli.options import force_option, json_option


@click.command(short_help="The article's claims against its own numbers.")
@click.option("--out", metavar="DIR", help="Also write a folder with a report.")
@force_option
@json_option
@click.pass_obj
def audit(console: Console, out, force):
    """Check each claim of the article whose gear and data hdcal bundles.

    Everything is computed here, from its formula and its Table 2; only what the
    article itself prints is given.
    """
    from hdcal.report.folder import check_target

    if out is not None:
        check_target(out, force=force)
    from hdcal.classical.audit.audit import audit as check_claims
    from hdcal.classical.audit.audit import summarise_audit
    from hdcal.classical.audit.document import audit_sheet, write_audit
    from hdcal.report.sheet import sheet_words

    found = summarise_audit(check_claims())
    console.table(*sheet_words(audit_sheet(found)))
    if out is not None:
        write_audit(found, out, force=force)
        console.words(f"the result: {out}  (open report.html)")
    if console.json:
        console.data(found)
    return 0
