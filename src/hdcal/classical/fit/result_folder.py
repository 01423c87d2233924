"""The result folder of `hdcal fit`, whole or not at all."""

from collections.abc import Sequence
from pathlib import Path

from hdcal.classical.fit.document import fit_sheet
from hdcal.classical.fit.figure import fit_figure
from hdcal.classical.fit.fit import PolynomialFit
from hdcal.data.case import Case
from hdcal.report.canvas import render
from hdcal.report.folder import whole_folder
from hdcal.report.page import data_rows, gear_rows
from hdcal.report.plain import as_json
from hdcal.report.sheet import sheet_page


def write_fits(
    case: Case,
    fits: Sequence[PolynomialFit],
    found: dict,
    target: Path | str,
    *,
    command: str = "",
    force: bool = False,
) -> None:
    """Write fit.json, the figure and the report.

    Args:
        case: that was fitted.
        fits: from `fit`.
        found: from `summarise_fits`.
        target: the folder to make.
        command: how the result was made, for its provenance.
        force: replace an older result.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    title = f"{case.gear.name}: classical fits"
    figure = fit_figure(case, fits)
    image = render(figure, "svg", title)
    facts = [*gear_rows(case, case.gear.theory), *data_rows(case)]
    facts += [("command", command)] if command else []
    page = sheet_page(fit_sheet(found), facts, {"fit": image})
    with whole_folder(target, force=force) as folder:
        (folder / "fit.json").write_text(as_json(found), "utf-8")
        (folder / "fit.svg").write_bytes(image)
        (folder / "fit.png").write_bytes(render(figure, "png", title))
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
