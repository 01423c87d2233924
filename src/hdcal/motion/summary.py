"""A dynamic calibration as an answer, and all that its result folder holds."""

from dataclasses import replace
from functools import cache
from typing import Any, cast

import numpy as np

from hdcal.inference.posterior_file import FILE_NAME
from hdcal.motion.answer import DynamicCalibrationAnswer, Loss
from hdcal.motion.bands import MotionBands, motion_bands
from hdcal.motion.document import (
    assumptions,
    headline,
    motion_document,
    next_steps,
)
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.dynamic_priors import FRICTION
from hdcal.motion.friction_search import dry_share, swing
from hdcal.motion.loss import LEFT_OVER, LOOKED, WHITENESS
from hdcal.report.intervals import Interval, credible_interval
from hdcal.report.posterior_answer import posterior_entries
from hdcal.report.write import Report

# A model less probable than this is not named.
_NAMED = 0.9


def dynamic_answer(posterior: DynamicPosterior) -> DynamicCalibrationAnswer:
    """Return a dynamic calibration as an answer, ready for JSON."""
    draws = posterior.draws
    ratio, frequency = draws["damping_ratio"], draws["natural_frequency"]
    damped = frequency * np.sqrt(np.maximum(1.0 - ratio**2, 0.0))
    free = credible_interval(frequency)
    loss = found_loss(posterior)
    steps = next_steps(posterior, loss)
    entries = posterior_entries(posterior, headline(free, loss), steps)
    return DynamicCalibrationAnswer(
        **entries,
        damping_N_s_per_mm=credible_interval(draws["damping"]),
        damping_ratio=credible_interval(ratio),
        natural_frequency_Hz=free,
        damped_frequency_Hz=credible_interval(damped),
        loss=loss,
        assumptions=assumptions(posterior),
    )


def found_loss(posterior: DynamicPosterior) -> Loss:
    """Return what takes the energy of a swing.

    A model whose residuals are no noise is not the right one, however much more
    probable it is than the others: then there is no name. The linear model whose
    residuals are noise needs no comparison where dry friction would have shown.
    """
    weighed = dict(posterior.loss)
    likeliest = max(weighed, key=lambda name: weighed[name], default=None)
    passed = {check.name for check in posterior.checks if check.outcome == "passed"}
    if likeliest and weighed[likeliest] < _NAMED:
        likeliest = "cannot tell"
    if weighed and LEFT_OVER not in passed:
        likeliest = None
    if not weighed and {WHITENESS, LOOKED} <= passed:
        likeliest = "viscous"
    share = _dry_share(posterior) if posterior.effects else None
    return Loss(cast(Any, likeliest), weighed, share)


def _dry_share(posterior: DynamicPosterior) -> Interval:
    draws, problem = posterior.draws, posterior.moving
    middle = {name: np.median(values, axis=0) for name, values in draws.items()}
    size = swing(problem, middle)
    parts = draws[FRICTION], draws["damping"], draws["natural_frequency"]
    return credible_interval(dry_share(*parts, size))


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
        from hdcal.report.chart_drawing import draw
        from hdcal.report.draws_charts import prior_chart, rank_chart

        failed = not posterior.usable

        return {
            "motion": motion_figure(posterior, bands()),
            "priors": draw(replace(prior_chart(posterior), failed=failed)),
            "sampler": draw(replace(rank_chart(posterior), failed=failed)),
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
