"""Gauge R&R: the scatter of force readings that is not a difference between gears.

Source:
    AIAG, Measurement Systems Analysis, 4th ed. (2010): study variation, tolerance and
    distinct categories from standard deviations.
"""

from collections.abc import Mapping

import numpy as np

from hdcal.fleets.next_gear import reading_sd
from hdcal.report.item import Interval, Item, quantity

# Distinct categories for each sd of the gears in an sd of the gauge.
_CATEGORIES = 1.41
# Standard deviations that are compared with a tolerance.
_WIDTH = 6.0


class GaugeRR(Item):
    """Sds of one reading of the force, and what it can distinguish; 95 % intervals.

    The study variation is the sd of all readings; six sds of the gauge are compared
    with the tolerance. Distinct categories are rounded down.
    """

    deformation_mm: float = quantity("deformation as read", "mm")
    repeatability_N: Interval = quantity("readings on one mounting", "N")
    reproducibility_N: Interval = quantity("mountings, operators and rigs", "N")
    gears_N: Interval = quantity("gears and lots", "N")
    percent_study_variation: Interval = quantity("share of the study variation", "%")
    percent_tolerance: Interval | None = quantity("share of the tolerance", "%")
    distinct_categories: Interval = quantity("distinct categories")


def gauge_rr(
    draws: Mapping[str, np.ndarray], deformation: float, tolerance: float | None = None
) -> GaugeRR:
    """Return the gauge R&R at a deformation [mm as read], and a tolerance [N]."""
    none = np.zeros(1)
    repeat = reading_sd(draws)
    force = draws["stiffness"] * abs(deformation)
    mounted = np.hypot(draws["run_offset_sd"], draws.get("operator_sd", none))
    mounted = np.hypot(mounted, force * draws.get("rig_sd", none))
    gears = force * np.hypot(draws["specimen_sd"], draws.get("lot_sd", none))
    gauge = np.hypot(repeat, mounted)
    share = None if tolerance is None else 100.0 * _WIDTH * gauge / tolerance
    categories = dict(Interval.of(_CATEGORIES * gears / gauge))
    return GaugeRR(
        deformation_mm=deformation,
        repeatability_N=Interval.of(repeat),
        reproducibility_N=Interval.of(mounted),
        gears_N=Interval.of(gears),
        percent_study_variation=Interval.of(100.0 * gauge / np.hypot(gauge, gears)),
        percent_tolerance=None if share is None else Interval.of(share),
        distinct_categories=Interval(
            **{n: float(int(v)) for n, v in categories.items()}
        ),
    )
