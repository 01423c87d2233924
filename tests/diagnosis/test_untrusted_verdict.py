"""A name in a case is only text in the report, figures and words of its verdict."""

from dataclasses import replace
from xml.etree import ElementTree

import pytest
from hostile_names import NAMES
from rich.console import Console
from slices import slice_of
from verdicts import named

from hdcal.diagnosis.chart import where_charts
from hdcal.diagnosis.document import verdict_document
from hdcal.diagnosis.figure.closure import shrink_figure
from hdcal.diagnosis.figure.where import where_figure
from hdcal.diagnosis.figure.which import which_figure
from hdcal.diagnosis.overview import overview_document, verdicts_answer
from hdcal.diagnosis.summary import verdict_answer
from hdcal.report.canvas import render
from hdcal.report.chart import charts_json
from hdcal.report.html import html_page
from hdcal.report.terminal import terminal_lines

FIGURES = {"where": where_figure, "which": which_figure, "shrink": shrink_figure}


def renamed(name: str):
    """Return a verdict with a name in every place that a file can name."""
    verdict = named()
    gear = replace(verdict.case.gear, name=name, material=name)
    case = replace(verdict.case, name=name, gear=gear, notes=(name,))
    cells = tuple(
        replace(cell, label=name, covariate="run") if not cell.unit else cell
        for cell in verdict.where.cells
    )
    where = replace(verdict.where, cells=cells)
    return replace(verdict, case=case, where=where, notes=(name,), reasons=(name,))


@pytest.mark.parametrize("name", slice_of(NAMES, NAMES[:1]))
def test_names_are_only_text_in_figures(name: str):
    for draw in FIGURES.values():
        tree = ElementTree.fromstring(render(draw(renamed(name)), "svg", name))
        tags = {element.tag.rpartition("}")[2] for element in tree.iter()}
        assert not tags & {"script", "img", "foreignObject", "a"}


@pytest.mark.parametrize("name", NAMES)
def test_names_are_only_text_in_the_page(name: str):
    verdict = renamed(name)
    found = verdict_answer(verdict)
    images = dict.fromkeys(FIGURES, b"<svg/>")
    page = html_page(verdict_document(found, verdict.case, name), images)
    assert "<" not in charts_json(where_charts(verdict))
    assert "<script" not in page and "<img src=x" not in page and "<!--" not in page
    assert "\x00" not in page and "\x1b" not in page and "49" + "{%" not in page
    assert page.count("<title>") == page.count("</title>") == 1


@pytest.mark.parametrize("name", NAMES)
def test_names_cannot_steer_the_terminal(name: str):
    found = verdict_answer(replace(renamed(name), reasons=()))
    terminal = Console(record=True, width=110, highlight=False, quiet=False)
    with terminal.capture() as caught:
        many = overview_document(verdicts_answer({name: found}))
        for document in (verdict_document(found, command=name), many):
            terminal.print(*terminal_lines(document, name))
    assert not set(caught.get()) & {"\x00", "\x1b", "\x07", "\u202e"}


@pytest.mark.thorough
def test_the_same_verdict_gives_the_same_bytes():
    for what in FIGURES:
        draw = FIGURES[what]
        for kind in ("svg", "png"):
            assert render(draw(named()), kind) == render(draw(named()), kind)
