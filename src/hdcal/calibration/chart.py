"""A calibration as charts: readings, bands, and the distances between them."""

from collections.abc import Iterator

import numpy as np

from hdcal.calibration.figure.bands import distance_from_model
from hdcal.data.loading import movement_words
from hdcal.inference.posterior import Posterior
from hdcal.inference.residuals import Residuals, residuals
from hdcal.prediction.bands.bands import Bands, default_bands
from hdcal.prediction.bands.chart import AXIS, FORCE, band_curves
from hdcal.report.canvas import thinned
from hdcal.report.chart import Chart, Series


def posterior_chart(posterior: Posterior) -> Chart:
    """Return force over deformation, with the readings."""
    return calibration_charts(default_bands(posterior), residuals(posterior))[0]


def calibration_charts(bands: Bands, left: Residuals) -> tuple[Chart, Chart]:
    """Return force over deformation, and the distance of readings from the fit."""
    curves, between = band_curves(bands)
    # Of several temperatures each has its own band around the fit.
    alone = len(np.unique(bands.temperature_C)) == 1
    around, edges = band_curves(bands, baseline=True) if alone else ([], [])
    force = [*curves, *_readings(left, left.measured, "measured")]
    distance = distance_from_model(bands, left)
    rest = [*around, *_readings(left, distance, "measured − fit")]
    return (
        Chart(AXIS, FORCE, force, between),
        Chart(AXIS, "measured − fit [N]", rest, edges, height=240),
    )


def residuals_chart(left: Residuals) -> Chart:
    """Return the distance of readings from the fit over deformation."""
    rest = list(_readings(left, left.residual, "measured − fitted"))
    return Chart(AXIS, "measured − fitted [N]", rest)


def _readings(left: Residuals, y: np.ndarray, words: str) -> Iterator[Series]:
    """Yield the readings of each direction as points."""
    kept = np.zeros(len(y), dtype=bool)
    kept[thinned(len(y))] = True
    ways = movement_words(left.deformation)
    for sense, colour in ((1, ""), (-1, "#8a949c")):
        rows = kept & (left.direction == sense)
        if rows.any():
            label = f"{words}, {ways[sense]} [N]"
            yield Series(label, left.deformation[rows], y[rows], colour, points=True)
