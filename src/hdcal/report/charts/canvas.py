"""How every figure looks, and how it becomes a file."""

import io
import logging
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from hdcal.report.plain import printable

FAILED = "FAILED — do not use"
_DARK, _RED = "#222222", "#b00020"
_MARK_LENGTH = 7.1
# Of a PNG; an SVG is always drawn in points.
_DPI, _SVG_DPI = 160, 72

# Where installed, these write what the default font lacks, such as Chinese.
_FONTS = ("Noto Sans CJK SC", "Noto Sans CJK JP", "WenQuanYi Zen Hei", "SimHei")
_STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.formatter.limits": (-5, 7),
    "axes.edgecolor": "#555555",
    "axes.grid": True,
    "axes.labelsize": 10,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 10,
    # Where it would be put, which takes a seventh of all drawing to find out.
    "axes.titley": 1.0,
    "axes.unicode_minus": True,
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
    "figure.facecolor": "white",
    "font.size": 9.5,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.8,
    "hatch.linewidth": 0.6,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "path.simplify": True,
    "svg.fonttype": "path",
    "svg.hashsalt": "hdcal",
    "text.usetex": False,
}


def style():
    """Return a context in which figures are drawn and rendered."""
    return mpl.rc_context({**_STYLE, "font.family": _families()})


@cache
def _families() -> list[str]:
    installed = {font.name for font in fontManager.ttflist}
    return ["DejaVu Sans", *(name for name in _FONTS if name in installed)]


def plain(text: str, length: int = 80) -> str:
    """Return a text from a file as one that matplotlib takes literally."""
    shown = printable(text)
    if len(shown) > length:
        shown = shown[: length - 1] + "…"
    # An even number of dollar signs would start a formula.
    return shown.replace("$", r"\$")


def render(figure: Figure, kind: Literal["svg", "png"], title: str = "") -> bytes:
    """Return a figure as the bytes of a file; the same figure, the same bytes."""
    target = io.BytesIO()
    metadata: dict[str, Any] = {"Title": printable(title)} if title else {}
    if kind == "svg":
        metadata["Date"] = None
    level = logging.getLogger("matplotlib").level
    with style(), warnings.catch_warnings():
        # A name may hold letters that no font here has: they become boxes.
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        logging.getLogger("matplotlib").setLevel(logging.ERROR)
        try:
            with _laid_out(figure, kind):
                figure.savefig(target, format=kind, dpi=_DPI, metadata=metadata)
        finally:
            logging.getLogger("matplotlib").setLevel(level)
    return target.getvalue()


@contextmanager
def _laid_out(figure: Figure, kind: Literal["svg", "png"]) -> Iterator[None]:
    """Place what a figure holds, for as many files as are made of it meanwhile.

    To place it, `savefig` would draw all of it twice, each time.
    """
    engine, canvas, dpi = figure.get_layout_engine(), figure.canvas, figure.dpi
    if engine is None:
        yield
        return
    try:
        # Sizes of texts depend on who draws them, and how finely.
        (FigureCanvasSVG if kind == "svg" else FigureCanvasAgg)(figure)
        figure.dpi = _SVG_DPI if kind == "svg" else _DPI
        engine.execute(figure)
        figure.set_layout_engine(None)
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.set_canvas(canvas)
        figure.dpi = dpi


def watermark(figure: Figure) -> None:
    """Write across a figure that its result must not be used."""
    # The words are some 7 inches long and half an inch high: all of them must show.
    rise = (0.95 * figure.get_figheight() - 0.6) / _MARK_LENGTH
    lean = min(28.0, math.degrees(math.asin(min(max(rise, 0.0), 1.0))))
    figure.text(
        0.5,
        0.5,
        FAILED,
        color=_RED,
        alpha=0.35,
        fontsize=44,
        fontweight="bold",
        rotation=lean,
        ha="center",
        va="center",
        zorder=100,
    )


def heading(axes: Axes, text: str) -> None:
    """Write a small heading above a panel, at its left edge."""
    axes.set_title(text, loc="left", fontweight="bold", color=_DARK)
    # What all numbers beside it have in common, 10⁻⁵ say, stands left of the heading.
    axes.yaxis.get_offset_text().set_horizontalalignment("right")
