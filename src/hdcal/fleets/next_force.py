"""The force that a gear to come needs at a deformation, and a capacity beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from hdcal.data.plausible import implausible
from hdcal.errors import Finding
from hdcal.fleets.next_gear import CONFIDENCE, new_group_sd, quantile_of_mixture
from hdcal.notebook import Shown
from hdcal.quantities import FORCE, Quantities
from hdcal.report.answer import Probability, Real, Units
from hdcal.report.intervals import Interval, credible_interval

# Shares of gears to come for which bounds are told.
CONTENTS = (0.9, 0.99)


@dataclass(frozen=True)
class ForceBounds:
    """What a share `content` of gears to come needs at least, and at most, in size.

    One-sided each, with the stated confidence, for one reading in a new mounting.
    """

    content: Probability
    confidence: Probability
    at_least_N: Real
    at_most_N: Real


@dataclass(frozen=True, repr=False)
class NextForce(Shown):
    """The force that a gear not yet measured needs, in size.

    Of one reading in a new mounting, by another operator on another rig where these are
    told, at the reference temperature; an odd gear is in it.

    Attributes:
        deformation_mm: that is asked for, as read.
        force_N: of one such gear, 95 % predictive interval.
        bounds: for many of them.
        limit_force_N: a capacity, its size; None where none is asked about.
        probability_exceeded: share of gears to come that need more, 95 % credible
            interval; None without a capacity.
        at_one_size: whether all of this is of a gear of the gear file's sizes, as those
            that were measured differ in theirs.
        beyond_tested: whether the deformation is larger than any that was read.
        units: names and units of what was measured; no part of the JSON answer.
    """

    deformation_mm: Real
    force_N: Interval
    bounds: tuple[ForceBounds, ...]
    limit_force_N: Real | None
    probability_exceeded: Interval | None
    at_one_size: bool = False
    beyond_tested: bool = False
    units: Units = field(default=FORCE, kw_only=True)


def next_force(
    draws: Mapping[str, np.ndarray],
    deformation: float,
    limit_force: float | None = None,
    seed: int = 0,
    *,
    contents: Sequence[float] = CONTENTS,
    confidence: float = CONFIDENCE,
) -> NextForce:
    """Return the force of gears to come at a deformation.

    Args:
        draws: of the population by site, shape (d,).
        deformation: as read, with the sign of the data [mm].
        limit_force: a capacity, its size [N].
        seed: of the predictive draws.
        contents: shares of gears to come that bounds are told of, above a half each.
        confidence: of each bound.
    """
    sense = np.sign(deformation) or 1.0
    mean = draws["stiffness"] * abs(deformation) + sense * draws["zero"]
    ordinary, far = _sds(draws, abs(deformation))
    share = draws["off_share"]
    rng = np.random.default_rng(seed)
    wide = np.where(rng.random(len(mean)) < share, far, ordinary)
    one = mean + wide * rng.standard_normal(len(mean))
    bounds = []
    for content in contents:
        reach = ordinary * quantile_of_mixture(content, share, far / ordinary)
        low = float(np.quantile(mean - reach, 1.0 - confidence))
        high = float(np.quantile(mean + reach, confidence))
        bounds.append(ForceBounds(content, confidence, max(low, 0.0), high))
    exceeded = None
    if limit_force is not None:
        beyond = (ndtr((mean - limit_force) / sd) for sd in (ordinary, far))
        usual, odd = beyond
        exceeded = credible_interval((1.0 - share) * usual + share * odd)
    told = credible_interval(one)
    return NextForce(deformation, told, tuple(bounds), limit_force, exceeded)


def deformation_findings(
    deformation: float, largest: float, reach: float, units: Quantities
) -> list[Finding]:
    """Return what is wrong with the deformation that is asked about.

    Args:
        deformation: as read [mm].
        largest: that was read [mm].
        reach: what no gear of this radius reaches [mm].
        units: of what was measured.
    """
    # Late: it is not needed to fit a fleet.
    from hdcal.prediction.conditions import far_findings

    wrong = implausible("deformation", deformation, units.displacement)
    unit = units.displacement_unit
    return wrong or far_findings(deformation, abs(largest), reach, unit)


def _sds(draws: Mapping[str, np.ndarray], size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return sds of one reading of an ordinary new gear, and of an odd one [N]."""
    reading = draws["sigma"] * np.exp(draws["noise_spread"] ** 2)
    mounted = np.hypot(draws["run_offset_sd"], new_group_sd(draws, "operator"))
    rest = np.hypot(reading, mounted)
    own, lots = draws["specimen_sd"], new_group_sd(draws, "lot")
    force = draws["stiffness"] * size
    rest = np.hypot(rest, force * new_group_sd(draws, "rig"))
    ratio = np.sqrt(1.0 + draws["off_ratio"] ** 2)
    return (
        np.hypot(rest, force * np.hypot(own, lots)),
        np.hypot(rest, force * np.hypot(own * ratio, lots)),
    )
