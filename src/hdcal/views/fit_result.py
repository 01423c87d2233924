"""The result folder of `hdcal fit`, whole or not at all."""

from collections.abc import Sequence
from pathlib import Path

from hdcal.answers.classical import PolynomialFit
from hdcal.rig.case import Case
from hdcal.views import figures
from hdcal.views.fit_sheet import fit_sheet
from hdcal.views.folder import whole_folder
from hdcal.views.page import data_rows, gear_rows
from hdcal.views.plain import as_json
from hdcal.views.sheet import sheet_page


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
    figure = figures.fit_figure(case, fits)
    image = figures.render(figure, "svg", title)
    facts = [*gear_rows(case, case.gear.theory), *data_rows(case)]
    facts += [("command", command)] if command else []
    page = sheet_page(fit_sheet(found), facts, {"fit": image})
    with whole_folder(target, force=force) as folder:
        (folder / "fit.json").write_text(as_json(found), "utf-8")
        (folder / "fit.svg").write_bytes(image)
        (folder / "fit.png").write_bytes(figures.render(figure, "png", title))
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
