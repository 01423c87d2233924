"""What `hdcal margin` leaves behind: plain data, figures and a report."""

from dataclasses import asdict
from pathlib import Path

from hdcal.inference.posterior import Posterior, versions
from hdcal.prediction.margin.document import answer
from hdcal.prediction.margin.figure import margin_figure, tornado_figure
from hdcal.prediction.margin.page import margin_report
from hdcal.prediction.margin.remarks import CALIBRATION_NOTE
from hdcal.prediction.margin.result import INTERVAL, Margin
from hdcal.report.canvas import render
from hdcal.report.folder import whole_folder
from hdcal.report.plain import as_json, as_plain

SCHEMA = "hdcal.margin/1"
KINDS = {
    "force_N": "mean of the population, equal-tailed credible interval",
    "member_N": "one future member, equal-tailed predictive interval",
    "lower_bound_N": "one-sided bound, content and confidence",
    "upper_bound_N": "one-sided bound, content and confidence",
    "capacity_N": "quantile of the population, with the stated confidence",
    "capacity_predictive_N": "quantile of the predictive distribution",
    "exceedance": "of one future member; lo and hi: credible interval of the share",
}


def margin_json(found: Margin, posterior: Posterior, *, seed: int = 0) -> dict:
    """Return a margin as plain data, ready for JSON.

    Args:
        found: from `margin`.
        posterior: of the likeliest model.
        seed: it was made with.
    """
    gear, case = posterior.case.gear, posterior.case
    return as_plain(
        {
            "schema": SCHEMA,
            "status": "ok",
            "reasons": [],
            "answer": answer(found),
            **asdict(found),
            "shares_note": CALIBRATION_NOTE,
            "interval": INTERVAL,
            "kinds": KINDS,
            "seed": seed,
            "versions": versions(),
            "gear": {
                "name": gear.name,
                "material": gear.material,
                "theory": posterior.theory,
            },
            "data": {
                "name": case.name,
                "rows": len(case.records.force),
                "sha256": case.data_sha256,
            },
        }
    )


def write_margin(
    found: Margin,
    posterior: Posterior,
    plain: dict,
    target: Path | str,
    *,
    command: str = "",
    force: bool = False,
) -> None:
    """Write the result folder of `hdcal margin`, whole or not at all.

    Args:
        found: from `margin`.
        posterior: of the likeliest model.
        plain: from `margin_json`.
        target: the folder to make.
        command: how the result was made.
        force: replace an older result.

    Raises:
        InputError: the folder exists or cannot be written.
    """
    name = posterior.case.gear.name
    drawn = {"margin": margin_figure(found, name)}
    if found.shares:
        drawn["tornado"] = tornado_figure(found)
    title = f"{name}: margin"
    images = {key: render(f, "svg", title) for key, f in drawn.items()}
    page = margin_report(found, posterior, plain, images, command)
    with whole_folder(target, force=force) as folder:
        (folder / "margin.json").write_text(as_json(plain), "utf-8")
        (folder / "report.html").write_bytes(page.encode("utf-8", "xmlcharrefreplace"))
        for key, figure in drawn.items():
            (folder / f"{key}.svg").write_bytes(images[key])
            (folder / f"{key}.png").write_bytes(render(figure, "png", title))
