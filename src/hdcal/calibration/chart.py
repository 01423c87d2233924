"""The picture of a calibration that one can touch: readings, bands, distances."""

from collections.abc import Iterator

import numpy as np

from hdcal.calibration.figure.bands import distance_from_model
from hdcal.data.loading import movement_words
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import Residuals
from hdcal.prediction.bands.bands import Bands
from hdcal.report.canvas import beyond
from hdcal.report.chart import Chart, Series

# Okabe and Ito's colours, by temperature.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
# Kind of a band, what it is called, and how strongly it is filled.
_BANDS = (
    ("new_measurement", "one new reading", 0.12),
    ("with_gap", "with the leftover discrepancy", 0.18),
    ("physics", "force model", 0.3),
)
# More readings than this make a page of many megabytes, and tell no more.
_MOST = 2000


def calibration_charts(
    posterior: Posterior, bands: Bands, left: Residuals
) -> tuple[Chart, Chart]:
    """Return force over deformation, and the distance of readings from the fit."""
    x = f"deformation ({posterior.case.gear.reading}) [mm]"
    curves, between = _curves(bands)
    around, edges = _curves(bands, baseline=True)
    force = [*curves, *_readings(left, left.measured, "measured")]
    rest = [
        *around,
        *_readings(left, distance_from_model(bands, left), "measured − fit"),
    ]
    return (
        Chart(x, "force [N]", force, between),
        Chart(x, "measured − fit [N]", rest, edges, height=240),
    )


def _curves(
    bands: Bands, *, baseline: bool = False
) -> tuple[list[Series], list[tuple[int, int, float]]]:
    """Return the bands of each temperature and direction, or how far they reach."""
    levels = np.unique(bands.temperature_C)
    curves: list[Series] = []
    between: list[tuple[int, int, float]] = []
    for level, direction in _branches(bands):
        if baseline and (level, direction) != next(_branches(bands)):
            continue
        rows = (bands.temperature_C == level) & (bands.direction == direction)
        x, middle = bands.deformation_mm[rows], bands.physics_median_N[rows]
        zero = middle if baseline else np.zeros(len(x))
        colour = _COLOURS[int(np.searchsorted(levels, level)) % len(_COLOURS)]
        named = f" at {level:g} °C" * (len(levels) > 1)
        named += f", {direction}" * (len({*bands.direction}) > 1)
        for kind, words, strength in _BANDS:
            high, low = (
                getattr(bands, f"{kind}_{end}_N")[rows] for end in ("hi", "lo")
            )
            if not np.isfinite(high).any():
                continue
            between.append((len(curves), len(curves) + 1, strength))
            for y, side in ((high, "97.5 %"), (low, "2.5 %")):
                label = f"{words}, {side}{named} [N]"
                curves.append(Series(label, x, y - zero, colour, width=0.0))
        if not baseline:
            tested = np.asarray(bands.tested[rows], dtype=bool)
            inside = np.where(tested, middle, np.nan)
            outside = np.where(beyond(tested), middle, np.nan)
            curves.append(Series(f"force model{named} [N]", x, inside, colour))
            if np.isfinite(outside).any():
                words = f"not tested{named} [N]"
                curves.append(Series(words, x, outside, colour, dashed=True))
    return curves, between


def _branches(bands: Bands) -> Iterator[tuple[float, str]]:
    for level in np.unique(bands.temperature_C):
        here = bands.direction[bands.temperature_C == level]
        for direction in dict.fromkeys(here.tolist()):
            yield float(level), direction


def _readings(left: Residuals, y: np.ndarray, words: str) -> Iterator[Series]:
    """Yield the readings of each direction as points."""
    kept = np.zeros(len(y), dtype=bool)
    kept[:: -(-len(y) // _MOST)] = True
    ways = movement_words(left.deformation)
    for sense, colour in ((1, ""), (-1, "#8a949c")):
        rows = kept & (left.direction == sense)
        if rows.any():
            label = f"{words}, {ways[sense]} [N]"
            yield Series(label, left.deformation[rows], y[rows], colour, points=True)
