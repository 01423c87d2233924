"""The figures of a calibration; the only place that knows matplotlib."""

from hdcal.views.figures.bands import calibration_figure
from hdcal.views.figures.canvas import render
from hdcal.views.figures.draws import prior_figure, sampler_figure
from hdcal.views.figures.leftover import residual_figure

__all__ = [
    "calibration_figure",
    "prior_figure",
    "render",
    "residual_figure",
    "sampler_figure",
]
