"""All figures; the only place that knows matplotlib."""

from hdcal.views.figures.bands import calibration_figure
from hdcal.views.figures.blind import (
    bar_figure,
    confusion_figure,
    detection_figure,
    reliability_figure,
)
from hdcal.views.figures.canvas import render
from hdcal.views.figures.classical import fit_figure
from hdcal.views.figures.design import (
    generator_figure,
    inverse_figure,
    profile_figure,
)
from hdcal.views.figures.draws import prior_figure, sampler_figure
from hdcal.views.figures.leftover import residual_figure
from hdcal.views.figures.margin import margin_figure, tornado_figure
from hdcal.views.figures.motion import motion_figure, response_figure
from hdcal.views.figures.shrink import shrink_figure
from hdcal.views.figures.study import study_figure
from hdcal.views.figures.where import where_figure
from hdcal.views.figures.which import which_figure

__all__ = [
    "bar_figure",
    "calibration_figure",
    "confusion_figure",
    "detection_figure",
    "fit_figure",
    "generator_figure",
    "inverse_figure",
    "margin_figure",
    "motion_figure",
    "prior_figure",
    "profile_figure",
    "reliability_figure",
    "render",
    "residual_figure",
    "response_figure",
    "sampler_figure",
    "shrink_figure",
    "study_figure",
    "tornado_figure",
    "where_figure",
    "which_figure",
]
