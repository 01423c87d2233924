"""A dynamic calibration as an answer, and all that its result folder holds."""

from functools import cache

import numpy as np

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.inference.posterior import FILE_NAME
from hdcal.motion.answer import DynamicCalibrationAnswer
from hdcal.motion.bands import MotionBands, motion_bands
from hdcal.motion.document import ASSUMPTIONS, headline, motion_document, next_steps
from hdcal.report.parameters import credible_interval
from hdcal.report.posterior_answer import posterior_entries
from hdcal.report.write import Report


def dynamic_answer(posterior: DynamicPosterior) -> DynamicCalibrationAnswer:
    """Return a dynamic calibration as an answer, ready for JSON."""
    draws = posterior.draws
    ratio, frequency = draws["damping_ratio"], draws["natural_frequency"]
    damped = frequency * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
    free = credible_interval(frequency)
    entries = posterior_entries(posterior, headline(free), next_steps(posterior))
    return DynamicCalibrationAnswer(
        **entries,
        damping_N_s_per_mm=credible_interval(draws["damping"]),
        damping_ratio=credible_interval(ratio),
        natural_frequency_Hz=free,
        damped_frequency_Hz=credible_interval(damped),
        assumptions=ASSUMPTIONS,
    )


def dynamic_report(
    posterior: DynamicPosterior, command: str = ""
) -> Report[DynamicCalibrationAnswer]:
    """Return all that `hdcal calibrate --dynamic` leaves behind."""
    found = dynamic_answer(posterior)

    @cache
    def bands() -> MotionBands:
        return motion_bands(posterior)

    def figures():
        from hdcal.motion.figure import motion_figure
        from hdcal.report.draws_figure import prior_figure, sampler_figure

        return {
            "motion": motion_figure(posterior, bands()),
            "priors": prior_figure(posterior),
            "sampler": sampler_figure(posterior),
        }

    return Report(
        motion_document(posterior, found, command),
        found,
        "summary.json",
        figures,
        kept=["motion"],
        tables=lambda: {"motion.csv": bands().columns()},
        others=lambda: [(FILE_NAME, posterior.to_netcdf())],
    )
