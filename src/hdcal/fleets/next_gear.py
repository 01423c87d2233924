"""Future gears: their stiffness, and the force that one of their readings needs.

Given the population, both are mixtures of normals about one mean: a future gear may be
an outlier in its stiffness and in its zero, with the population's probabilities. It
belongs to a lot, an operator and a rig that were not measured.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.optimize.elementwise import find_root
from scipy.special import ndtr, ndtri

from hdcal.data.plausible import implausible
from hdcal.errors import Finding
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.prediction.conditions import far_findings
from hdcal.report.item import Interval, Item, Probability, quantity

# Shares of future gears, and the confidence, of the bounds.
_CONTENTS, _CONFIDENCE = (0.9, 0.95, 0.99), 0.95


class Bounds(Item):
    """One-sided bounds of a share of the future gears, each with the confidence."""

    content: Probability = quantity("share of future gears")
    confidence: Probability = quantity("confidence of each bound")
    at_least: float = quantity("at least")
    at_most: float = quantity("at most")


class Mixture(NamedTuple):
    """Normal components about one mean, by population draw; (d,) and twice (c, d)."""

    mean: np.ndarray
    sd: np.ndarray
    weight: np.ndarray

    def sample(self, seed: int) -> np.ndarray:
        """Return one member for each draw of the population."""
        rng = np.random.default_rng(seed)
        below = np.cumsum(self.weight, axis=0) < rng.random(len(self.mean))
        component = below.sum(axis=0)[None]
        sd = np.take_along_axis(self.sd, component, axis=0)[0]
        return self.mean + sd * rng.standard_normal(len(self.mean))

    def above(self, limit: float) -> np.ndarray:
        """Return the share of members above a limit, for each draw."""
        return np.sum(self.weight * ndtr((self.mean - limit) / self.sd), axis=0)

    def bounds(self, content: float) -> Bounds:
        """Return one-sided bounds of a share above a half, none below zero.

        Each bound holds for at least `content` of the members, in the stated share
        (confidence) of the posterior draws.
        """

        def excess(reach, *parts):
            weight, sd = np.split(np.stack(parts), 2)
            return np.sum(weight * ndtr(reach / sd), axis=0) - content

        ends = np.zeros_like(self.mean), ndtri(content) * self.sd.max(axis=0)
        reach = find_root(excess, ends, args=(*self.weight, *self.sd)).x
        low = float(np.quantile(self.mean - reach, 1.0 - _CONFIDENCE))
        high = float(np.quantile(self.mean + reach, _CONFIDENCE))
        ends = {"at_least": max(low, 0.0), "at_most": high}
        return Bounds(content=content, confidence=_CONFIDENCE, **ends)


class NextGear(Item):
    """Stiffness of a gear that was not measured; 95 % predictive interval."""

    stiffness_N_per_mm: Interval = quantity("stiffness of the next gear", "N/mm")
    bounds: tuple[Bounds, ...]


class NextForce(Item):
    """Size of the force of one reading of a gear that was not measured, 95 % intervals.

    The deformation may be beyond all that were read.
    """

    deformation_mm: float = quantity("deformation as read", "mm")
    force_N: Interval = quantity("force of the next gear", "N")
    bounds: tuple[Bounds, ...]
    limit_force_N: float | None = quantity("capacity", "N")
    probability_exceeded: Interval | None = quantity("share above the capacity")
    beyond_tested: bool


def stiffness_of_gears(draws: Mapping[str, np.ndarray]) -> Mixture:
    """Return the stiffness of future gears [N/mm as read], by draws of all sites."""
    mean, share = draws["stiffness"], draws["off_share"]
    sd = mean * _relative_sd(draws)
    return Mixture(mean, sd, np.stack([1.0 - share, share]))


def force_of_gears(draws: Mapping[str, np.ndarray], deformation: float) -> Mixture:
    """Return the size of the force of one reading of each future gear [N].

    The deformation is as read, with the sign of the data [mm].
    """
    sense, force = np.sign(deformation) or 1.0, draws["stiffness"] * abs(deformation)
    rest = np.hypot(reading_sd(draws), force * new_group_sd(draws, "rig"))
    rest = np.hypot(rest, new_group_sd(draws, "operator"))
    own = force * _relative_sd(draws)
    zero = draws["run_offset_sd"] * _wide(draws["zero_off_ratio"])
    # Stiffness of ordinary gears and outliers by zero of both, [2, 2, draw].
    sd = np.sqrt(own[:, None] ** 2 + zero**2 + rest**2)
    odd, odd_zero = draws["off_share"], draws["zero_off_share"]
    weight = np.stack([1.0 - odd, odd])[:, None] * np.stack([1.0 - odd_zero, odd_zero])
    flat = 4, len(force)
    mean = force + sense * draws["zero"]
    return Mixture(mean, sd.reshape(flat), weight.reshape(flat))


def next_gear(draws: Mapping[str, np.ndarray], seed: int) -> NextGear:
    """Return the stiffness of future gears."""
    gears = stiffness_of_gears(draws)
    return NextGear(
        stiffness_N_per_mm=Interval.of(gears.sample(seed)),
        bounds=tuple(map(gears.bounds, _CONTENTS)),
    )


def next_force(
    draws: Mapping[str, np.ndarray],
    deformation: float,
    limit_force: float | None = None,
    *,
    tested: float,
    seed: int = 0,
) -> NextForce:
    """Return the force of future gears at a deformation, of any sign [mm as read].

    The capacity is a size [N]; `tested` is the largest deformation read.
    """
    gears = force_of_gears(draws, deformation)
    above = None if limit_force is None else Interval.of(gears.above(limit_force))
    return NextForce(
        deformation_mm=deformation,
        force_N=Interval.of(gears.sample(seed)),
        bounds=tuple(map(gears.bounds, _CONTENTS)),
        limit_force_N=limit_force,
        probability_exceeded=above,
        # A deformation is compared with itself as it was written.
        beyond_tested=abs(deformation) > abs(tested) * (1.0 + 1e-9),
    )


def force_findings(
    readings: FleetReadings, deformation: float | None, limit_force: float | None
) -> list[Finding]:
    """Return what is wrong with a deformation, which may be None, and a capacity."""
    gear, units = readings.case.gear, readings.case.units
    wrong = implausible("limit_force", limit_force, "sigma")
    if deformation is None:
        words, remedy = "has no deformation", "Give `deformation` too"
        if limit_force is not None:
            wrong.append(Finding("limit_force", words, remedy))
        return wrong
    impossible = implausible("deformation", deformation, units.displacement)
    far = gear, units, deformation, abs(readings.largest), readings.contact
    return wrong + (impossible or far_findings(*far))


def reading_sd(draws: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the root mean square of the noise of ordinary gears, (d,) [N]."""
    # The noise sd of gears is lognormal.
    return draws["sigma"] * np.exp(draws["noise_spread"] ** 2)


def new_group_sd(draws: Mapping[str, np.ndarray], kind: str) -> np.ndarray:
    """Return the sd of a new lot, operator or rig about the mean of those measured."""
    if f"{kind}_sd" not in draws:
        return np.zeros(1)
    # The mean of those measured has an error too.
    measured = sum(name.removeprefix(f"{kind}_").isdigit() for name in draws)
    return draws[f"{kind}_sd"] * np.sqrt(1.0 + 1.0 / measured)


def _relative_sd(draws: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the sd of the stiffness of ordinary gears and of outliers, (2, d) [-]."""
    own = draws["specimen_sd"] * _wide(draws["off_ratio"])
    return np.hypot(own, new_group_sd(draws, "lot"))


def _wide(ratio: np.ndarray) -> np.ndarray:
    """Return sds of ordinary gears and of outliers in that of the former, (2, d)."""
    return np.stack([np.ones_like(ratio), np.sqrt(1.0 + ratio**2)])
