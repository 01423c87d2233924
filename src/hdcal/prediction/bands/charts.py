"""Bands as a chart: the curves of each temperature and direction."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hdcal.data.loading import loading_side, movement_words
from hdcal.report.charts.axes import load_axis
from hdcal.report.charts.chart_spec import (
    Band,
    Chart,
    Dash,
    Line,
    Mark,
    Panel,
    ascending_colours,
    beyond,
)

if TYPE_CHECKING:
    from hdcal.prediction.bands.result import Bands

# Kind of a band, its label and its opacity; each lies on those before it.
_BANDS = (
    ("new_measurement", "one new reading", 0.16),
    ("with_gap", "with the discrepancy", 0.22),
    ("physics", "mean {load}", 0.38),
)
_UNTESTED = "not tested: extrapolated"


class Branch(NamedTuple):
    """The curves of one temperature [°C] and direction; the label is of the median.

    The legend shows the bands of the first branch. Bands are the fainter the more of
    them lie upon each other.
    """

    temperature: float
    rows: np.ndarray
    colour: str
    loading: bool
    label: str
    first: bool
    opacity: float


def bands_chart(bands: "Bands") -> Chart:
    """Return force over deformation."""
    units = bands.units
    axis = f"{units.displacement} as read [{units.displacement_unit}]"
    return Chart(panels=[Panel(x=axis, y=load_axis(units), marks=band_marks(bands))])


def band_marks(bands: "Bands") -> list[Mark]:
    """Return the bands of the force, and upon them the medians."""
    marks = [mark for b in branches(bands) for mark in branch_marks(bands, b)]
    return sorted(marks, key=lambda mark: isinstance(mark, Line))


def branches(bands: "Bands") -> list[Branch]:
    """Return temperatures in ascending order, each with its directions."""
    levels = np.unique(bands.temperature_C)
    colours = ascending_colours(len(levels))
    # The tested side; the curves may go beyond zero to a nominal deformation.
    tested = np.asarray(bands.tested, bool)
    places = bands.deformation_mm[tested if tested.any() else slice(None)]
    places = places - bands.contact
    side, name = loading_side(places), bands.units.displacement
    words, opacity = movement_words(places, name), 1.0 / np.sqrt(len(levels))
    every: list[Branch] = []
    for level, colour in zip(levels.tolist(), colours, strict=True):
        here = bands.temperature_C == level
        ways = list(dict.fromkeys(bands.direction[here].tolist()))
        for way in ways:
            rows = np.flatnonzero(here & (bands.direction == way))
            rows = rows[np.argsort(bands.deformation_mm[rows], kind="stable")]
            loads = len(ways) == 1 or way == ("down" if side < 0 else "up")
            label = f"median at {level:g} °C" if len(levels) > 1 else "median"
            if not loads:
                # The dash of the first one explains all.
                movement = words[1 if way == "up" else -1]
                label = "" if len(every) > 1 else f"median, {movement}"
            first = not every
            every.append(Branch(level, rows, colour, loads, label, first, opacity))
    return every


def branch_marks(
    bands: "Bands", branch: Branch, *, around_model: bool = False
) -> Iterator[Mark]:
    """Yield bands and medians of one temperature and direction.

    Around the model: as distances from it without the bend, and without labels.
    """
    rows, colour = branch.rows, branch.colour
    x, tested = bands.deformation_mm[rows], np.asarray(bands.tested[rows], bool)
    untested = beyond(tested)
    middle = bands.physics_median_N[rows]
    zero = bands.straight_N[rows] if around_model else np.zeros(len(x))

    def part(values: np.ndarray, shown: np.ndarray) -> np.ndarray:
        return np.where(shown, values - zero, np.nan)

    def label(text: str) -> str:
        text = text.format(load=bands.units.load)
        return text if branch.first and not around_model else ""

    for kind, words, full in _BANDS:
        low, high = (getattr(bands, f"{kind}_{end}_N")[rows] for end in ("lo", "hi"))
        hatched = kind == "new_measurement"
        for shown, text, opacity, lined in (
            (tested, words, full, False),
            (untested, _UNTESTED if hatched else "", full / 3.0, hatched),
        ):
            if np.isfinite(part(low, shown)).any():
                yield Band(
                    label=label(text),
                    x=x,
                    low=part(low, shown),
                    high=part(high, shown),
                    colour=colour,
                    opacity=opacity * branch.opacity,
                    hatched=lined,
                )
    whole: Dash = "solid" if branch.loading else "dashed"
    name = "" if around_model else branch.label
    curves: list[tuple[np.ndarray, str, Dash, float]] = [
        (part(middle, tested), name, whole, 1.6),
        (part(middle, untested), label(_UNTESTED), "dotted", 1.6),
        (bands.with_gap_median_N[rows] - zero, "", "dashdot", 1.0),
    ]
    for y, text, dash, width in curves:
        if np.isfinite(y).any():
            yield Line(label=text, x=x, y=y, colour=colour, dash=dash, width=width)
