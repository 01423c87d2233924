"""Bands as a chart: the curves of each temperature and direction."""

from collections.abc import Iterator

import numpy as np

from hdcal.prediction.bands.bands import Bands
from hdcal.report.canvas import beyond
from hdcal.report.chart import COLOURS, Chart, Series

# Kind of a band, what it is called, and how strongly it is filled.
_BANDS = (
    ("new_measurement", "one new reading", 0.12),
    ("with_gap", "with the leftover discrepancy", 0.18),
    ("physics", "force model", 0.3),
)
AXIS, FORCE = "deformation as read [mm]", "force [N]"


def bands_chart(bands: Bands) -> Chart:
    """Return force over deformation."""
    return Chart(AXIS, FORCE, *band_curves(bands))


def band_curves(
    bands: Bands, *, baseline: bool = False
) -> tuple[list[Series], list[tuple[int, int, float]]]:
    """Return the bands of each temperature and direction, and what lies between.

    Args:
        bands: of any number of curves.
        baseline: how far those of the first curve reach from its median.
    """
    levels = np.unique(bands.temperature_C)
    branches = list(_branches(bands))
    curves: list[Series] = []
    between: list[tuple[int, int, float]] = []
    for level, direction in branches[:1] if baseline else branches:
        rows = np.flatnonzero(
            (bands.temperature_C == level) & (bands.direction == direction)
        )
        rows = rows[np.argsort(bands.deformation_mm[rows], kind="stable")]
        x, middle = bands.deformation_mm[rows], bands.physics_median_N[rows]
        zero = middle if baseline else np.zeros(len(x))
        colour = COLOURS[int(np.searchsorted(levels, level)) % len(COLOURS)]
        named = f" at {level:g} °C" * (len(levels) > 1)
        named += f", {direction}" * (len({*bands.direction}) > 1)
        for kind, words, strength in _BANDS:
            ends = (f"{kind}_hi_N", f"{kind}_lo_N")
            high, low = (getattr(bands, name)[rows] for name in ends)
            if not np.isfinite(high).any():
                continue
            between.append((len(curves), len(curves) + 1, strength))
            for y, side in ((high, "97.5 %"), (low, "2.5 %")):
                label = f"{words}{named}, {side} [N]"
                curves.append(Series(label, x, y - zero, colour, width=0.0))
        if not baseline:
            curves += _middle(x, middle, bands.tested[rows], named, colour)
    return curves, between


def _middle(x, middle, tested, named: str, colour: str) -> Iterator[Series]:
    """Yield the median, where it was tested and where not."""
    inside = np.asarray(tested, dtype=bool)
    for words, rows, dashed in (
        (f"median of the model{named} [N]", inside, False),
        (f"not tested{named} [N]", beyond(inside), True),
    ):
        if rows.any():
            y = np.where(rows, middle, np.nan)
            yield Series(words, x, y, colour, dashed=dashed)


def _branches(bands: Bands) -> Iterator[tuple[float, str]]:
    for level in np.unique(bands.temperature_C):
        here = bands.direction[bands.temperature_C == level]
        for direction in dict.fromkeys(here.tolist()):
            yield float(level), direction
