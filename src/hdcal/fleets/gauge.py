"""Gauge R&R: which part of what force readings scatter by is the gears' own.

Source:
    AIAG, Measurement Systems Analysis, 4th ed. (2010): study variation, tolerance and
    distinct categories from standard deviations.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hdcal.report.answer import Real
from hdcal.report.intervals import Interval, credible_interval

# Widths of a 97 % interval of the gauge that fit into the gears' scatter.
_CATEGORIES = 1.41
# Standard deviations that a tolerance is compared with.
_WIDTH = 6.0


@dataclass(frozen=True)
class GaugeAnswer:
    """How well one reading of the force tells gears apart; 95 % credible intervals.

    Attributes:
        deformation_mm: at which it is read, as read.
        repeatability_N: sd of readings on one mounting.
        reproducibility_N: sd between mountings, and operators and rigs where they are
            told.
        gears_N: sd between ordinary gears, and lots where they are told.
        percent_study_variation: gauge over all that scatters, by sds.
        percent_tolerance: six sds of the gauge over the tolerance; None without one.
        distinct_categories: gears that one reading can tell apart, a whole number.
    """

    deformation_mm: Real
    repeatability_N: Interval
    reproducibility_N: Interval
    gears_N: Interval
    percent_study_variation: Interval
    percent_tolerance: Interval | None
    distinct_categories: Interval


def gauge(
    draws: Mapping[str, np.ndarray], deformation: float, tolerance: float | None = None
) -> GaugeAnswer:
    """Return what the scatters of a fleet say of its gauge.

    Args:
        draws: of the population by site, shape (d,).
        deformation: at which the force is read [mm as read].
        tolerance: width within which the force may lie [N].
    """
    none = np.zeros(1)
    # The mean square over gears, whose noise is lognormal.
    repeat = draws["sigma"] * np.exp(draws["noise_spread"] ** 2)
    force = draws["stiffness"] * abs(deformation)
    mounted = np.hypot(draws["run_offset_sd"], draws.get("operator_sd", none))
    mounted = np.hypot(mounted, force * draws.get("rig_sd", none))
    gears = force * np.hypot(draws["specimen_sd"], draws.get("lot_sd", none))
    of_gauge = np.hypot(repeat, mounted)
    share = 100.0 * of_gauge / np.hypot(of_gauge, gears)
    told = credible_interval(_CATEGORIES * gears / of_gauge)
    return GaugeAnswer(
        deformation_mm=float(deformation),
        repeatability_N=credible_interval(repeat),
        reproducibility_N=credible_interval(mounted),
        gears_N=credible_interval(gears),
        percent_study_variation=credible_interval(share),
        percent_tolerance=None
        if tolerance is None
        else credible_interval(100.0 * _WIDTH * of_gauge / tolerance),
        distinct_categories=Interval(*(float(int(end)) for end in vars(told).values())),
    )
