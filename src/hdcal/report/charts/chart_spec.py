"""Charts as declarations, drawn by `chart_drawing` and, in a page, `chart_browser`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

# Okabe and Ito's colours, distinct in every kind of colour vision; INK is the colour of
# the text.
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
YELLOW, SKY, GREY, RED, INK = "#E69F00", "#56B4E9", "#8a8a8a", "#b00020", ""
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, YELLOW, SKY)
_ASCENDING = (BLUE, SKY, GREEN, YELLOW, ORANGE, RED)
# More points than this make larger files and show nothing more.
MOST_DRAWN = 4000
Dash = Literal["solid", "dashed", "dotted", "dashdot"]


@dataclass(frozen=True, kw_only=True)
class Line:
    """A curve; NaN interrupts it. `x` ascends."""

    label: str = ""
    x: np.ndarray
    y: np.ndarray
    colour: str = BLUE
    dash: Dash = "solid"
    width: float = 1.6


@dataclass(frozen=True, kw_only=True)
class Points:
    """Points, with error bars from `low` to `high` if given."""

    label: str = ""
    x: np.ndarray
    y: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None
    colour: str = INK
    marker: str = "o"


@dataclass(frozen=True, kw_only=True)
class Band:
    """The area between two curves; NaN interrupts it. `hatched`: extrapolated."""

    label: str = ""
    x: np.ndarray
    low: np.ndarray
    high: np.ndarray
    colour: str = BLUE
    opacity: float = 0.25
    hatched: bool = False


@dataclass(frozen=True, kw_only=True)
class Bars:
    """Bars from `low` (0) to `high` at places, often 1, 2, … of named categories."""

    label: str = ""
    at: np.ndarray
    high: np.ndarray
    low: np.ndarray | None = None
    colour: str = BLUE
    width: float = 0.7


@dataclass(frozen=True, kw_only=True)
class Rule:
    """A straight line across the panel, at a value of one axis."""

    at: float
    axis: Literal["x", "y"] = "y"
    label: str = ""
    colour: str = INK
    dash: Dash = "solid"


@dataclass(frozen=True, kw_only=True)
class Span:
    """A shaded strip across the panel, between two values of one axis."""

    low: float
    high: float
    axis: Literal["x", "y"] = "y"
    label: str = ""
    colour: str = GREY
    opacity: float = 0.15


Mark = Line | Points | Band | Bars | Rule | Span


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Marks on two axes, drawn in their order; a label has one entry of the legend.

    A wide panel takes a whole row. The height is in inches, 0: by the marks.
    """

    x: str
    y: str
    marks: Sequence[Mark]
    title: str = ""
    # Categories at 1, 2, … of the x axis; horizontal bars leave room for long ones.
    names: Sequence[str] = ()
    horizontal: bool = False
    y_limits: tuple[float | None, float | None] = (None, None)
    x_log: bool = False
    y_ticks: bool = True
    wide: bool = False
    height: float = 0.0
    legend_beside: bool = False


@dataclass(frozen=True, kw_only=True)
class Chart:
    """Panels in rows; those that are not wide may share axes.

    A page shows a static chart as an image; a failed one is marked.
    """

    panels: Sequence[Panel]
    columns: int = 1
    share_x: bool = False
    share_y: bool = False
    static: bool = False
    failed: bool = False

    @property
    def interactive(self) -> bool:
        """Whether a page can zoom it: without names, bars and the mark of failure."""
        bars = any(isinstance(m, Bars) for panel in self.panels for m in panel.marks)
        named = any(panel.names for panel in self.panels)
        return not (self.static or self.failed or named or bars)


def ascending_colours(count: int) -> list[str]:
    """Return a colour for each of some ascending levels, from blue to red."""
    places = np.round(np.linspace(0.0, len(_ASCENDING) - 1.0, count)).astype(int)
    return [_ASCENDING[place] for place in places]


def beyond(tested: np.ndarray) -> np.ndarray:
    """Return the untested rows of a curve, with those next to them to leave no gap."""
    before, after = np.append(False, ~tested[:-1]), np.append(~tested[1:], False)
    return ~tested | after | before


def drawn_rows(y: np.ndarray) -> np.ndarray:
    """Return the rows to draw: all, or a random choice and the most extreme ones."""
    if len(y) <= MOST_DRAWN:
        return np.arange(len(y))
    chosen = np.random.default_rng(0).choice(len(y), MOST_DRAWN, replace=False)
    return np.union1d(chosen, np.argsort(-np.abs(y - np.nanmedian(y)))[:50])
