"""A figure becomes the file that matplotlib would write, in half the time."""

import io
from typing import Literal

import pytest
from matplotlib.figure import Figure

from hdcal.report.charts.canvas import render, style

DATE: dict = {"svg": {"Date": None}, "png": {}}


def drawn(layout: Literal["constrained"] | None = "constrained") -> Figure:
    """Return two panels whose labels take more room than they have by default."""
    with style():
        figure = Figure(figsize=(5.0, 3.0), layout=layout)
        left, right = figure.subplots(1, 2)
        left.plot([0.0, 1000.0], [1e-3, 2e-3])
        left.set_ylabel("two lines\nof a label")
        right.plot([0.0, 1.0], [100.0, 20000.0], label="force")
        right.set_xlabel("deformation [mm]", fontsize=20)
        right.legend()
    return figure


def saved(figure: Figure, kind: str) -> bytes:
    """Return the file as matplotlib writes it."""
    target = io.BytesIO()
    with style():
        figure.savefig(target, format=kind, dpi=160, metadata=DATE[kind])
    return target.getvalue()


@pytest.mark.parametrize("kind", ["svg", "png"])
def test_everything_stands_where_matplotlib_puts_it(kind: Literal["svg", "png"]):
    expected = saved(drawn(), kind)
    assert render(drawn(), kind) == expected
    assert render(drawn(None), kind) == saved(drawn(None), kind) != expected


def test_a_figure_can_be_rendered_again():
    figure, twin = drawn(), drawn()
    engine, size = figure.get_layout_engine(), figure.dpi
    for kind in ("svg", "png", "svg"):
        assert render(figure, kind) == saved(twin, kind)
        assert figure.get_layout_engine() is engine and figure.dpi == size
