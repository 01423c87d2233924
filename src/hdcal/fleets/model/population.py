"""The posterior of a fleet: the population of each quantity, and every gear in it.

The noise comes first. What the residuals of a gear tell of its noise is integrated over
in the other quantities, which tell next to nothing of the noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from hdcal.fleets.model.gear_noise import GearNoise, gear_noise
from hdcal.fleets.model.gear_quantity import GearQuantity, draw_gears
from hdcal.fleets.model.groups import group_offsets
from hdcal.fleets.model.line_fits import line_fits
from hdcal.fleets.model.priors import population_priors
from hdcal.fleets.model.quantities import FleetGroups, Problems, noise_problem
from hdcal.fleets.model.sampling import Sampling
from hdcal.fleets.reading.mounting_sums import MountingSums
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.inference.checks import Check
from hdcal.inference.sample import Progress
from hdcal.report.item import TAILS

# In the order in which they are sampled.
QUANTITIES = ("noise", "stiffness", "zero", "loop", "bend")
# Names of sites in the draws; other sites get the name of the quantity before theirs.
_SITES = {
    "stiffness": {
        "centre": "stiffness",
        "spread": "specimen_sd",
        "off_share": "off_share",
        "off_ratio": "off_ratio",
    },
    "zero": {"centre": "zero", "spread": "run_offset_sd"},
    "noise": {"centre": "sigma"},
    "loop": {"centre": "loop"},
    "bend": {"centre": "bend"},
}
_GROUPS = ("lot_", "rig_", "operator_")
# Gears that the population is sampled from, at most; of more a random choice of so
# many, which tell its scatter to 1 %.
MOST_SAMPLED = 5_000
# Draws of the population over which the noise of gears and their probability of being
# odd is averaged.
_AVERAGED = 100
# Draws of the population for which every gear is drawn too: more for few gears, up to
# a million in all, and at most as many as memory holds.
_GEAR_DRAWS, _IN_ALL, _MOST_DRAWN = 400, 1_000_000, 20_000_000
_SETTINGS = ("seed", "chains", "warmup", "draws")


@dataclass(frozen=True)
class FittedFleet:
    """Posterior of a population and of its gears.

    Attributes:
        draws: of the population by site, shape (d,).
        gears: one row a gear: stiffness, stiffness_lo, stiffness_hi [N/mm as read],
            apart_percent, apart_lo, apart_hi, distance_sd, zero_N, noise_sd_N, loop_N,
            bend_N, and off_stiffness, … off_bend, the probability of being odd.
        stiffness: draws of each gear at the sizes of the gear file, shape (t, g)
            [N/mm as read].
        correlation: of neighbouring residuals, for which intervals are widened.
        lots: names in the order of lot_1, … of the draws; empty without lots.
        operators: likewise.
        rigs: likewise.
        unit: stiffness at K = 1 [N/mm as read].
        checks: of the samplers.
        settings: of the run.
    """

    draws: Mapping[str, np.ndarray]
    gears: pd.DataFrame
    stiffness: np.ndarray
    correlation: float
    lots: Sequence[str]
    operators: Sequence[str]
    rigs: Sequence[str]
    unit: float
    checks: tuple[Check, ...]
    settings: Mapping[str, Any]


class _Populations:
    """Draws and checks of the populations that were sampled so far.

    Args:
        sampling: settings of the samplers.
        gears: number of gears.
    """

    def __init__(self, sampling: Sampling, gears: int):
        rng = np.random.default_rng(sampling.seed)
        self._sampling = sampling
        self._chosen = np.sort(rng.permutation(gears)[:MOST_SAMPLED])
        self.draws: dict[str, np.ndarray] = {}
        self.checks: list[Check] = []

    def sample(
        self,
        name: str,
        problem: GearNoise | GearQuantity,
        start: Mapping[str, float],
        many: int = _AVERAGED,
    ) -> dict[str, np.ndarray]:
        """Sample the population of a quantity, and return so many of its draws."""
        part = replace(self._sampling, progress=_part(self._sampling.progress, name))
        values, checks = part.run(name, problem.some(self._chosen), start)
        self.checks.extend(checks)
        for site, value in values.items():
            plain = site if site.startswith(_GROUPS) else f"{name}_{site}"
            self.draws[_SITES[name].get(site, plain)] = value
        every = -(-len(next(iter(values.values()))) // many)
        return {site: value[::every] for site, value in values.items()}


def fit_population(readings: FleetReadings, sampling: Sampling) -> FittedFleet:
    """Sample the population, and every gear given its draws.

    Args:
        readings: at the sizes of the gear file.
        sampling: settings of the samplers.
    """
    sums, seed = readings.sums, sampling.seed
    groups = FleetGroups.of(readings.case, sums.run)
    fits = line_fits(sums, groups.rig, readings.step)
    unit, priors = population_priors(readings.case)
    gears = len(groups.lot)
    populations = _Populations(sampling, gears)

    noisy, start = noise_problem(fits, priors)
    noise, noise_sd, odd = gear_noise(noisy, populations.sample("noise", noisy, start))
    table = {"noise_sd_N": noise_sd, "off_noise": odd}

    slots = max(map(int, (np.bincount(fits.gear).max(), np.bincount(sums.gear).max())))
    problems = Problems(groups, noise, noise_sd, priors, slots)
    problem, start = problems.stiffness(fits)
    many = min(max(_GEAR_DRAWS, _IN_ALL // gears), _MOST_DRAWN // gears)
    values = populations.sample("stiffness", problem, start, many)
    stiffness, columns = _stiffness(problem, values, seed)
    table |= columns

    zeros, error, shared = _zeros(sums, groups.rig)
    zeros, widening = readings.side * zeros, fits.widening
    problem, start = problems.zero(sums, zeros, widening * error, widening * shared)
    values = populations.sample("zero", problem, start)
    table["zero_N"] = np.bincount(sums.gear, zeros) / np.bincount(sums.gear)
    table["off_zero"] = _odd(problem, values, seed)

    largest_force = abs(readings.largest * float(np.median(fits.slope)))
    for name in ("loop", "bend"):
        table |= {f"{name}_N": np.full(gears, np.nan), f"off_{name}": np.zeros(gears)}
        shape = problems.shape(fits, name, largest_force)
        if shape is not None:
            values = populations.sample(name, *shape)
            table[f"{name}_N"] = _means(getattr(fits, name), fits.gear, gears)
            table[f"off_{name}"] = _odd(shape[0], values, seed)
    return FittedFleet(
        draws=populations.draws,
        gears=pd.DataFrame(table),
        stiffness=stiffness,
        correlation=fits.correlation,
        lots=groups.lots,
        operators=groups.operators,
        rigs=groups.rigs,
        unit=unit,
        checks=tuple(populations.checks),
        settings={name: getattr(sampling, name) for name in _SETTINGS},
    )


def _part(progress: Progress | None, name: str) -> Progress | None:
    """Return a progress of one quantity, as a part of that of all quantities."""
    if progress is None:
        return None
    before, every = QUANTITIES.index(name), len(QUANTITIES)
    return lambda done, total: progress(before * total + done, every * total)


def _stiffness(
    problem: GearQuantity, values: Mapping[str, np.ndarray], seed: int
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return draws of the stiffness of each gear, shape (t, g), and its columns."""
    drawn = draw_gears(problem, values, seed)
    apart = np.asarray(drawn.apart)
    lots = np.asarray(group_offsets(values, "lot"))[np.asarray(problem.lot)].T
    stiffness = values["centre"][:, None] * (1.0 + lots) * (1.0 + apart)
    columns = {"off_stiffness": np.asarray(drawn.off).mean(axis=0)}
    for name, draws in (("stiffness", stiffness), ("apart", 100.0 * apart)):
        low, middle, high = np.quantile(draws, TAILS, axis=0)
        columns |= {name: middle, f"{name}_lo": low, f"{name}_hi": high}
    columns["apart_percent"] = columns.pop("apart")
    distance = np.median(apart / values["spread"][:, None], axis=0)
    return stiffness, columns | {"distance_sd": distance}


def _zeros(
    sums: MountingSums, rig: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the zero of each mounting beside the line of its gear on its rig.

    Mountings of a gear on one rig share the error of the slope. On several rigs it
    counts as that of the mounting, which it is with one mounting on each.

    Args:
        sums: of each mounting.
        rig: of each mounting, shape (m,).

    Returns:
        Zeros, shape (m,) [N]; variance of their errors over σ², shape (m,); and of the
        errors that the mountings of a gear share, shape (g,).
    """
    rigs = 1 + int(rig.max())
    pairs, pair = np.unique(sums.gear * rigs + rig, return_inverse=True)
    whole = np.bincount(pair, sums.products[:, 0, 0])
    moved = whole > 0.0
    xy = np.bincount(pair, sums.products[:, 0, 3])
    slope = np.where(moved, xy / np.where(moved, whole, 1.0), 0.0)
    # A gear that never moved on a rig has its slope from the others.
    gear = pairs // rigs
    of_gear = np.bincount(gear, xy) / np.bincount(gear, whole)
    slope = np.where(moved, slope, of_gear[gear])[pair]
    whole = np.where(moved, whole, np.bincount(gear, whole)[gear])[pair]
    x = sums.mean[:, 0]
    of_slope = x**2 / whole
    several = np.bincount(gear)[sums.gear] > 1
    count = np.bincount(sums.gear)
    shared = np.where(several, 0.0, of_slope)
    error = 1.0 / sums.rows + np.where(several, of_slope, 0.0)
    return (
        sums.mean[:, 3] - slope * x,
        error,
        np.bincount(sums.gear, shared) / count,
    )


def _odd(problem: GearQuantity, values, seed: int) -> np.ndarray:
    """Return the probability of each gear being odd; zero where nothing is known."""
    known = np.any(np.asarray(problem.present) > 0.0, axis=1)
    odd = np.asarray(draw_gears(problem, values, seed).off).mean(axis=0)
    return np.where(known, odd, 0.0)


def _means(values: np.ndarray, gear: np.ndarray, gears: int) -> np.ndarray:
    """Return the mean of the values of each gear over its rigs; NaN without any."""
    known = np.isfinite(values)
    count = np.bincount(gear[known], minlength=gears)
    whole = np.bincount(gear[known], values[known], gears)
    return np.where(count > 0, whole / np.maximum(count, 1), np.nan)
