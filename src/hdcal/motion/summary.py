"""A dynamic calibration as an answer: the numbers and words of its summary.json."""

import numpy as np

from hdcal.inference.dynamic_posterior import DynamicPosterior
from hdcal.motion.answer import DynamicCalibrationAnswer
from hdcal.motion.document import ASSUMPTIONS, headline, next_steps
from hdcal.report.parameters import credible_interval
from hdcal.report.posterior_answer import posterior_entries


def dynamic_answer(posterior: DynamicPosterior) -> DynamicCalibrationAnswer:
    """Return a dynamic calibration as an answer, ready for JSON.

    Args:
        posterior: from `calibrate_dynamic`.
    """
    draws = posterior.draws
    ratio, frequency = draws["damping_ratio"], draws["natural_frequency"]
    damped = frequency * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
    free = credible_interval(frequency)
    steps = next_steps(posterior)
    return DynamicCalibrationAnswer(
        **posterior_entries(posterior),
        headline=headline(free, posterior.reasons),
        next_step=steps[0] if steps else None,
        damping_N_s_per_mm=credible_interval(draws["damping"]),
        damping_ratio=credible_interval(ratio),
        natural_frequency_Hz=free,
        damped_frequency_Hz=credible_interval(damped),
        assumptions=ASSUMPTIONS,
    )
