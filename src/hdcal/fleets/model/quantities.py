"""Population of each quantity of the gears, as a problem to sample."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hdcal.data.case import Case
from hdcal.data.prior import Prior
from hdcal.evidence.base_model import moments, stiffness_prior
from hdcal.fleets.model.gear_noise import GearNoise
from hdcal.fleets.model.gear_quantity import GearQuantity, NoiseNodes
from hdcal.fleets.model.groups import (
    Grouping,
    distinguished,
    gains_of_rigs,
    medians_of_groups,
    robust_sd,
)
from hdcal.fleets.model.line_fits import LineFits
from hdcal.fleets.reading.readings import MountingSums
from hdcal.inference.force_model.priors import problem_priors
from hdcal.inference.force_model.problem import without_texts

# By judgement one gear in ten is an outlier in its stiffness, one in a hundred in
# another quantity, some six times as far out as ordinary gears. The noise of gears on
# one rig differs by 1 to 100 %. Lots and gains of rigs scatter about as gears of one
# lot do, seldom a tenth of it or seven times as far; zeros of operators as those of
# mountings.
ODD_STIFFNESS, ODD = Prior("beta", (1.0, 9.0)), Prior("beta", (1.0, 99.0))
ODD_RATIO = Prior("lognormal", (6.0, 0.7))
NOISE_SPREAD = Prior("lognormal", (0.1, 1.2))
GROUP_RATIO = Prior("lognormal", (0.7, 1.2))
# Shares of the largest force: a loop or a bend of all gears, and how much gears differ,
# by a factor of some four either way.
_SHAPE, _SHAPE_SPREAD, _SHAPE_LOG_SD = 0.05, 0.005, 1.4
# Least relative scatter that is noticeable.
_LEAST = 1e-4
# Sds from the centre at which few ordinary gears are.
_FAR = 4.0

# A problem with values near its mode, from which a search is short.
Quantity = tuple[GearQuantity, dict[str, float]]


@dataclass(frozen=True)
class FleetGroups:
    """Names of lots, rigs and operators, none where they are not distinguished.

    With the index of the lot of each gear, and of rig and operator of each mounting.
    """

    lots: list[str]
    lot: np.ndarray
    rigs: list[str]
    rig: np.ndarray
    operators: list[str]
    operator: np.ndarray

    @classmethod
    def of(cls, case: Case, run: np.ndarray) -> "FleetGroups":
        """Return the groups of a case; run is that of each mounting, shape (m,)."""
        gear = np.arange(len(case.specimen_labels))
        columns: list[Any] = []
        kinds = (case.lots, gear), (case.rigs, run), (case.operators, run)
        for labels, member in kinds:
            names, index = distinguished(labels)
            columns += [names, index[member] if names else np.zeros(len(member), int)]
        return cls(*columns)


def population_priors(case: Case) -> tuple[float, dict[str, Prior]]:
    """Return the stiffness at K = 1 [N/mm as read], and the priors of a population."""
    own = problem_priors(case, (), {}, case.gear.theory)
    half = 0.5 if case.gear.reading == "diametral" else 1.0
    log_mean, log_sd, nominal = stiffness_prior(case, own)
    centre = half * float(np.exp(log_mean))
    zero, gauge_sd = moments(own, "force_offset")
    contact, contact_sd = moments(own, "deformation_offset")
    zero_sd = float(np.hypot(gauge_sd, centre * contact_sd))
    return half * nominal, {
        "stiffness": Prior("lognormal", (centre, log_sd)),
        "zero": Prior("normal", (zero - centre * contact, zero_sd)),
        **{name: own[name] for name in ("specimen_sd", "run_offset_sd", "sigma")},
    }


def shape_priors(largest_force: float) -> tuple[Prior, Prior]:
    """Return the priors of the loop or bend of all gears, and of its scatter [N]."""
    scatter = _SHAPE_SPREAD * largest_force
    return (
        Prior("normal", (0.0, _SHAPE * largest_force)),
        Prior("lognormal", (scatter, _SHAPE_LOG_SD)),
    )


def noise_problem(
    fits: LineFits, priors: Mapping[str, Prior]
) -> tuple[GearNoise, dict[str, float]]:
    """Return the population of the noise sd of gears."""
    own = {"centre": priors["sigma"], "spread": NOISE_SPREAD}
    odd = {"off_share": ODD, "off_ratio": ODD_RATIO}
    problem = GearNoise(own | odd, fits.freedom, fits.log_sd)
    known = fits.log_sd[fits.freedom > 0.0]
    start = {"centre": float(np.exp(np.median(known)))} if len(known) else {}
    return problem, start


@dataclass(frozen=True)
class Problems:
    """Problems of the quantities of one fleet, all of one structure.

    The noise of each gear has its median in `noise_sd`, (g,) [N]; a gear has rows in so
    many slots at most.
    """

    groups: FleetGroups
    noise: NoiseNodes
    noise_sd: np.ndarray
    priors: Mapping[str, Prior]
    slots: int

    def stiffness(self, fits: LineFits) -> Quantity:
        """Return the population of the stiffness, which is relative to the centre."""
        groups, middle = self.groups, float(np.median(fits.slope))
        apart = fits.slope / middle - 1.0
        sd = np.sqrt(fits.slope_error) * self.noise_sd[fits.gear] / middle
        variance = np.maximum(sd, _LEAST) ** 2
        found: dict[str, Grouping] = {}
        if groups.rigs:
            found["rig"] = gains_of_rigs(apart, variance, fits.gear, fits.rig)
            apart = apart - found["rig"].offsets[fits.rig]
        gears = len(groups.lot)
        whole = np.bincount(fits.gear, 1.0 / variance, gears)
        of_gear = np.bincount(fits.gear, apart / variance, gears)
        # A gear without a slope of its own lies in the middle.
        none = np.full(gears, np.median(apart))
        of_gear = np.divide(of_gear, whole, out=none, where=whole > 0.0)
        if groups.lots:
            found["lot"] = medians_of_groups(of_gear, groups.lot)
            of_gear = of_gear - found["lot"].offsets[groups.lot]
        median, log_sd = self.priors["stiffness"].numbers
        own = {
            "_centre": Prior("normal", (float(np.log(median)), float(log_sd))),
            "spread": self.priors["specimen_sd"],
            "off_share": ODD_STIFFNESS,
        }
        columns = {"value": fits.slope, "error": fits.slope_error, "rig": fits.rig}
        problem = self._problem(own, fits.gear, columns, found, relative=1.0)
        start = _start(of_gear, 1.0)
        start["_centre"] = float(np.log(middle * (1.0 + start["_centre"])))
        return problem, start

    def zero(self, sums: MountingSums, zeros, error, shared) -> Quantity:
        """Return the population of the zeros (m,), which scatter between mountings [N].

        The variances over σ² are those of their errors, (m,), and of the error that all
        zeros of a gear share, (g,).
        """
        operator, rest = self.groups.operator, zeros
        found: dict[str, Grouping] = {}
        if self.groups.operators:
            found["operator"] = medians_of_groups(zeros, operator)
            rest = zeros - found["operator"].offsets[operator]
        own = {
            "_centre": self.priors["zero"],
            "spread": self.priors["run_offset_sd"],
            "off_share": ODD,
        }
        columns = {"value": zeros, "error": error, "operator": operator}
        how = {"shared": shared, "by_row": 1.0}
        problem = self._problem(own, sums.gear, columns, found, **how)
        return problem, _start(rest, float(np.median(self.noise_sd)))

    def shape(self, fits: LineFits, name: str, largest_force: float) -> Quantity:
        """Return the population of the loop or the bend, by its name."""
        value, error = getattr(fits, name), getattr(fits, f"{name}_error")
        known = np.isfinite(value)
        centre, spread = shape_priors(largest_force)
        own = {"_centre": centre, "spread": spread, "off_share": ODD}
        columns = {"value": value[known], "error": error[known]}
        problem = self._problem(own, fits.gear[known], columns, {})
        return problem, _start(value[known], float(np.median(self.noise_sd)))

    def _problem(
        self,
        priors: Mapping[str, Prior],
        gear: np.ndarray,
        columns: Mapping[str, np.ndarray],
        groups: Mapping[str, Grouping],
        *,
        shared: np.ndarray | None = None,
        relative: float = 0.0,
        by_row: float = 0.0,
    ) -> GearQuantity:
        """Return a problem; columns have a value for each row, gear is their gear."""
        gears = len(self.groups.lot)
        order = np.argsort(gear, kind="stable")
        slot = np.empty(len(gear), int)
        slot[order] = np.arange(len(gear)) - np.searchsorted(gear[order], gear[order])

        def dense(name: str, fill: float) -> np.ndarray:
            table = np.full((gears, self.slots), fill)
            table[gear, slot] = columns.get(name, fill)
            return table

        present = np.zeros((gears, self.slots))
        present[gear, slot] = 1.0
        priors = {**priors, "off_ratio": ODD_RATIO}
        priors |= {f"{kind}_ratio": GROUP_RATIO for kind in groups}
        return GearQuantity(
            priors=without_texts(priors),
            value=dense("value", 0.0),
            error=dense("error", 1.0),
            present=present,
            rig=dense("rig", 0),
            operator=dense("operator", 0),
            shared=np.zeros(gears) if shared is None else shared,
            lot=self.groups.lot,
            noise=self.noise,
            groups=dict(groups),
            relative=np.asarray(relative),
            by_row=np.asarray(by_row),
        )


def _start(values: np.ndarray, unit: float) -> dict[str, float]:
    """Return rough centre, scatter (clear in a unit) and share of outliers."""
    middle = float(np.median(values))
    sd = robust_sd(values - middle)
    far = np.sum(np.abs(values - middle) > _FAR * sd)
    start = {"_centre": middle, "off_share": float((1.0 + far) / (10.0 + len(values)))}
    # A scatter of zero, as of few or of rounded readings, is no place to start from.
    return start | ({"spread": sd} if sd > _LEAST * unit else {})
