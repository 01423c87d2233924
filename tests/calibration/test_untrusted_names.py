"""A name from a file is only text, in the page and in the figures."""

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hostile_names import NAMES
from markupsafe import escape
from rich.console import Console
from slices import slice_of

from hdcal.calibration.document import calibration_document
from hdcal.calibration.figure.bands import calibration_figure
from hdcal.calibration.figure.residuals import residual_figure
from hdcal.calibration.summary import calibration_answer
from hdcal.data.prior import Prior
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import residuals
from hdcal.prediction.bands.bands import default_bands
from hdcal.report.canvas import render
from hdcal.report.draws_figure import prior_figure, sampler_figure
from hdcal.report.html import html_page, notebook_html
from hdcal.report.plain import as_json
from hdcal.report.terminal import terminal_lines


@pytest.fixture(scope="module")
def posterior(calibrated) -> Posterior:
    """The posterior of a result folder, read back."""
    return Posterior.load(calibrated[1])


def renamed(posterior: Posterior, name: str) -> Posterior:
    """Return the posterior with a name in every place that a file can name."""
    case = posterior.case
    gear = replace(case.gear, name=name, material=name)
    case = replace(case, name=name, gear=gear, notes=(name,), run_labels=(name,))
    old = posterior.priors["K"]
    prior = Prior(old.family, old.numbers, old.unit, name)
    return replace(posterior, case=case, priors={**posterior.priors, "K": prior})


@pytest.mark.parametrize("name", slice_of(NAMES, NAMES[:2]))
def test_names_are_only_text(name: str, posterior: Posterior):
    posterior = renamed(posterior, name)
    left = residuals(posterior)
    drawn = {
        "calibration": calibration_figure(posterior, default_bands(posterior), left),
        "residuals": residual_figure(posterior, left),
        "priors": prior_figure(posterior),
        "sampler": sampler_figure(posterior),
    }
    images = {}
    for what, figure in drawn.items():
        images[what] = render(figure, "svg", name)
        tree = ElementTree.fromstring(images[what])
        tags = {element.tag.rpartition("}")[2] for element in tree.iter()}
        assert not tags & {"script", "img", "foreignObject", "a"}
    # The only one that is written as a bitmap too.
    render(drawn["calibration"], "png", name)
    found = calibration_answer(posterior, left)
    document = calibration_document(posterior, found, name)
    page = html_page(document, images)
    assert "<script" not in page and "<img src=x" not in page and "<!--" not in page
    assert "\x00" not in page and "\x1b" not in page and "49" + "{%" not in page
    assert page.count("<title>") == page.count("</title>") == 1
    as_json(found)
    cell = notebook_html(document)
    assert "<script" not in cell and "<img src=x" not in cell
    terminal = Console(width=110, highlight=False)
    with terminal.capture() as caught:
        terminal.print(*terminal_lines(document, name), sep="\n")
    assert not set(caught.get()) & {"\x00", "\x1b", "\x07", "\u202e"}


def test_the_same_draws_give_the_same_bytes(posterior: Posterior):
    left, bands = residuals(posterior), default_bands(posterior)

    def draw(kind):
        figure = calibration_figure(posterior, bands, left)
        return render(figure, kind, "title")

    assert draw("svg") == draw("svg")
    assert draw("png") == draw("png")


def test_the_data_of_the_report_are_those_of_the_case(
    posterior: Posterior, calibrated: tuple[object, Path]
):
    page = (calibrated[1] / "report.html").read_text("utf-8")
    assert posterior.case.data_sha256 in page
    assert posterior.case.gear.name in page
    shown = [p for name, p in posterior.priors.items() if name in posterior.draws]
    for prior in shown:
        assert str(escape(prior.source)) in page
