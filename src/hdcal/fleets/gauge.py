"""Gauge R&R: the scatter of force readings that is not a difference between gears.

Source:
    AIAG, Measurement Systems Analysis, 4th ed. (2010): study variation, tolerance and
    distinct categories from standard deviations.
"""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from hdcal.fleets.next_gear import reading_sd
from hdcal.report.item import Interval, Item, quantity

# Distinct categories for each sd of the gears in an sd of the gauge.
_CATEGORIES = 1.41
# Standard deviations that are compared with a tolerance.
_WIDTH = 6.0
# Customary upper ends of each grade [%].
_GOOD, _ACCEPTABLE = 10.0, 30.0
Grade = Literal["good", "acceptable", "not good enough", "not settled"]


class GaugeRR(Item):
    """Ability of one reading of the force to distinguish gears; 95 % intervals.

    Attributes:
        repeatability_N: sd of readings on one mounting.
        reproducibility_N: sd between mountings, operators and rigs.
        gears_N: sd between ordinary gears and lots.
        percent_study_variation: sd of the gauge over that of all readings.
        percent_tolerance: six sds of the gauge over the tolerance.
        distinct_categories: that one reading can distinguish, rounded down.
        grade: by the share of the tolerance, if there is one, else of the study
            variation; settled if the whole interval has one grade.
    """

    deformation_mm: float = quantity("deformation as read", "mm")
    repeatability_N: Interval = quantity("repeatability", "N")
    reproducibility_N: Interval = quantity("reproducibility", "N")
    gears_N: Interval = quantity("gears and lots", "N")
    percent_study_variation: Interval = quantity("share of the study variation", "%")
    percent_tolerance: Interval | None = quantity("share of the tolerance", "%")
    distinct_categories: Interval = quantity("distinct categories")
    grade: Grade


def gauge_rr(
    draws: Mapping[str, np.ndarray], deformation: float, tolerance: float | None = None
) -> GaugeRR:
    """Return the gauge R&R of a population, from its draws by site.

    The force is read at a deformation [mm as read]; it may lie within a width [N].
    """
    none = np.zeros(1)
    repeat = reading_sd(draws)
    force = draws["stiffness"] * abs(deformation)
    mounted = np.hypot(draws["run_offset_sd"], draws.get("operator_sd", none))
    mounted = np.hypot(mounted, force * draws.get("rig_sd", none))
    gears = force * np.hypot(draws["specimen_sd"], draws.get("lot_sd", none))
    gauge = np.hypot(repeat, mounted)
    study = Interval.of(100.0 * gauge / np.hypot(gauge, gears))
    share = None if tolerance is None else 100.0 * _WIDTH * gauge / tolerance
    within = None if share is None else Interval.of(share)
    categories = dict(Interval.of(_CATEGORIES * gears / gauge))
    return GaugeRR(
        deformation_mm=deformation,
        repeatability_N=Interval.of(repeat),
        reproducibility_N=Interval.of(mounted),
        gears_N=Interval.of(gears),
        percent_study_variation=study,
        percent_tolerance=within,
        distinct_categories=Interval(
            **{n: float(int(v)) for n, v in categories.items()}
        ),
        grade=_grade(within or study),
    )


def _grade(share: Interval) -> Grade:
    if share.hi < _GOOD:
        return "good"
    if share.lo >= _GOOD and share.hi < _ACCEPTABLE:
        return "acceptable"
    return "not good enough" if share.lo >= _ACCEPTABLE else "not settled"
