"""A picture that one can touch: its numbers, for a browser that may run scripts.

What is drawn beside it as an image is shown on paper and where no script runs.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Okabe and Ito's colours, told apart by every kind of colour vision.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Half of the width at which an interval at a whole number is drawn.
_HALF = 0.3
# Digits of a number: more than a screen shows when it is zoomed in.
_DIGITS = 6


@dataclass(frozen=True)
class Series:
    """One curve, or one set of points.

    Attributes:
        label: what it is called beside its value.
        x: shape (n,); of a curve in ascending order.
        y: shape (n,); NaN where there is nothing.
        colour: #RRGGBB; empty for that of the text around it.
        points: drawn as points, else as a line.
        width: of the line; 0 for the edge of a band.
        dashed: whether the line is.
    """

    label: str
    x: np.ndarray
    y: np.ndarray
    colour: str
    points: bool = False
    width: float = 2.0
    dashed: bool = False


@dataclass(frozen=True)
class Chart:
    """Series over one axis.

    Attributes:
        x: what the axis shows, with its unit.
        y: likewise.
        series: in the order of the legend.
        bands: pairs of series (upper, lower) by their places, and the opacity of what
            lies between them.
        height: in pixels.
        names: what stands at 1, 2, … of the axis, in place of the numbers.
        marked: places whose names stand there also where not all of them have room.
        limits: least and largest value that y can have; None where there is none.
    """

    x: str
    y: str
    series: Sequence[Series]
    bands: Sequence[tuple[int, int, float]] = ()
    height: int = 380
    names: Sequence[str] = ()
    marked: Sequence[int] = ()
    limits: tuple[float | None, float | None] = (None, None)

    def plain(self) -> dict:
        """Return it as the page's script takes it: all series over the same places."""
        shared = [series.x for series in self.series if not series.points]
        places = [np.unique(np.concatenate(shared))] if shared else []
        places += [series.x for series in self.series if series.points]
        over = np.concatenate(places)
        order = np.argsort(over, kind="stable")
        begin, columns = len(over) - sum(len(x) for x in places[bool(shared) :]), []
        for series in self.series:
            if series.points:
                column = np.full(len(over), np.nan)
                column[begin : begin + len(series.y)] = series.y
                begin += len(series.y)
            else:
                outside = {"left": np.nan, "right": np.nan}
                column = np.interp(over, series.x, series.y, **outside)
            columns.append(column)
        return {
            "x": self.x,
            "y": self.y,
            "height": self.height,
            "names": [*self.names],
            "marked": [*self.marked],
            "limits": [*self.limits],
            "bands": [list(band) for band in self.bands],
            "series": [
                {n: v for n, v in vars(each).items() if n not in ("x", "y")}
                for each in self.series
            ],
            "data": [_numbers(column[order]) for column in (over, *columns)],
        }


def boxes(
    starts: np.ndarray, stops: np.ndarray, levels: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a curve that is level from each start to its stop, nothing between them.

    Args:
        starts: shape (n,), in ascending order.
        stops: shape (n,), none beyond the next start.
        levels: shape (n,).

    Returns:
        Places and values, each of shape (4n,).
    """
    # Wide enough to be seen: a narrower one falls between two points of a screen.
    edge = 0.04 * (stops - starts)
    last, nothing = stops - edge, np.full(len(starts), np.nan)
    along = np.column_stack([starts + edge, last, last + 0.1 * edge, last + 0.5 * edge])
    return along.ravel(), np.column_stack([levels, levels, levels, nothing]).ravel()


def interval_boxes(
    place: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    ends: tuple[str, str] = ("95 % interval, 97.5 %", "95 % interval, 2.5 %"),
    unit: str = "N/mm",
) -> list[Series]:
    """Return intervals as a band of boxes: upper ends, then lower ones.

    Args:
        place: of each, whole numbers, shape (n,).
        low: lower ends, shape (n,).
        high: upper ends, shape (n,).
        ends: what the upper ones are called, and the lower ones.
        unit: of both.
    """
    return [
        Series(
            f"{words} [{unit}]",
            *boxes(place - _HALF, place + _HALF, levels),
            COLOURS[0],
            width=0.0,
        )
        for words, levels in zip(ends, (high, low), strict=True)
    ]


def charts_json(charts: Sequence[Chart]) -> str:
    """Return charts as the text of a script element, in which nothing can end it."""
    text = json.dumps([chart.plain() for chart in charts], separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _numbers(values: np.ndarray) -> list[float | None]:
    return [
        float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None
        for value in values
    ]
