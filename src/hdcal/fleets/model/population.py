"""The posterior of a fleet: the population of each quantity, and every gear in it.

The noise comes first: in the other quantities, which hold next to nothing about it, it
is integrated over.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from hdcal.fleets.model.gear_noise import gear_noise
from hdcal.fleets.model.gear_quantity import MOST_FALSE, GearQuantity, draw_gears
from hdcal.fleets.model.groups import group_offsets
from hdcal.fleets.model.line_fits import LineFits, line_fits
from hdcal.fleets.model.quantities import (
    FleetGroups,
    Problems,
    noise_problem,
    population_priors,
)
from hdcal.fleets.model.sampling import Populations, Sampling
from hdcal.fleets.reading.mounting_sums import MountingSums
from hdcal.fleets.reading.readings import FleetReadings
from hdcal.inference.checks import Check
from hdcal.report.item import TAILS

_SHAPES = ("loop", "bend")
# Fewest gears that tell how much their loops or bends differ.
_FEWEST = 3
# Draws of the population over which the noise of gears and their probability of being
# odd is averaged.
_AVERAGED = 100
# Draws of the population for which every gear is drawn too: more for few gears, up to
# a million in all, and at most as many as memory holds.
_GEAR_DRAWS, _IN_ALL, _MOST_DRAWN = 400, 1_000_000, 20_000_000


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
        unit: stiffness at K = 1 [N/mm as read].
    """

    draws: Mapping[str, np.ndarray]
    gears: pd.DataFrame
    stiffness: np.ndarray
    groups: FleetGroups
    fits: LineFits
    unit: float
    checks: Sequence[Check]
    settings: Mapping[str, Any]

    @property
    def failed(self) -> tuple[str, ...]:
        """Words of the checks that failed."""
        return tuple(c.words for c in self.checks if c.outcome == "failed")

    def flagged(self, quantity: str) -> np.ndarray:
        """Return which gears are flagged in a quantity, shape (g,)."""
        return 1.0 - self.gears[f"off_{quantity}"].to_numpy() <= MOST_FALSE


def fit_population(readings: FleetReadings, sampling: Sampling) -> FittedFleet:
    """Sample the population at the sizes of the gear file, and every gear given it."""
    sums, seed = readings.sums, sampling.seed
    groups = FleetGroups.of(readings.case, sums.run)
    fits = line_fits(sums, groups.rig, readings.step)
    unit, priors = population_priors(readings.case)
    gears = len(groups.lot)
    known = {name: fits.gear[np.isfinite(getattr(fits, name))] for name in _SHAPES}
    shapes = [n for n, of in known.items() if len(np.unique(of)) >= _FEWEST]
    names = "noise", "stiffness", "zero", *shapes
    populations = Populations(sampling, gears, names)

    noisy, start = noise_problem(fits, priors)
    values = populations.sample("noise", noisy, start, _AVERAGED)
    noise, noise_sd, odd = gear_noise(noisy, values)
    table = {"noise_sd_N": noise_sd, "off_noise": odd}

    slots = max(np.bincount(fits.gear).max(), np.bincount(sums.gear).max())
    problems = Problems(groups, noise, noise_sd, priors, int(slots))
    problem, start = problems.stiffness(fits)
    many = min(max(_GEAR_DRAWS, _IN_ALL // gears), _MOST_DRAWN // gears)
    values = populations.sample("stiffness", problem, start, many)
    stiffness, columns = _stiffness(problem, values, seed)
    table |= columns

    zeros, error, shared = _zeros(sums, groups.rig)
    zeros, wider = readings.side * zeros, fits.widening
    problem, start = problems.zero(sums, zeros, wider * error, wider * shared)
    values = populations.sample("zero", problem, start, _AVERAGED)
    table["zero_N"] = np.bincount(sums.gear, zeros) / np.bincount(sums.gear)
    table["off_zero"] = _odd(problem, values, seed)

    largest_force = abs(readings.largest * float(np.median(fits.slope)))
    for name in _SHAPES:
        table |= {f"{name}_N": np.full(gears, np.nan), f"off_{name}": np.zeros(gears)}
        if name in shapes:
            problem, start = problems.shape(fits, name, largest_force)
            values = populations.sample(name, problem, start, _AVERAGED)
            sizes: Any = pd.Series(getattr(fits, name)).groupby(fits.gear).mean()
            table[f"{name}_N"] = sizes.reindex(range(gears)).to_numpy()
            table[f"off_{name}"] = _odd(problem, values, seed)
    return FittedFleet(
        draws=populations.draws,
        gears=pd.DataFrame(table),
        stiffness=stiffness,
        groups=groups,
        fits=fits,
        unit=unit,
        checks=tuple(populations.checks),
        settings=sampling.settings,
    )


def _stiffness(
    problem: GearQuantity, values: Mapping[str, np.ndarray], seed: int
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return draws of the stiffness of each gear, shape (t, g), and its columns."""
    drawn = draw_gears(problem, values, seed)
    apart = np.asarray(drawn.apart)
    lots = np.asarray(group_offsets(values, "lot"))[np.asarray(problem.lot)].T
    stiffness = values["centre"][:, None] * (1.0 + lots) * (1.0 + apart)
    low, middle, high = np.quantile(stiffness, TAILS, axis=0)
    columns = {"stiffness": middle, "stiffness_lo": low, "stiffness_hi": high}
    low, middle, high = np.quantile(100.0 * apart, TAILS, axis=0)
    columns |= {"apart_percent": middle, "apart_lo": low, "apart_hi": high}
    columns["distance_sd"] = np.median(apart / values["spread"][:, None], axis=0)
    columns["off_stiffness"] = np.asarray(drawn.off).mean(axis=0)
    return stiffness, columns


def _zeros(
    sums: MountingSums, rig: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the zero of each mounting beside the line of its gear on its rig.

    Mountings of a gear on one rig share the error of the slope. On several rigs it
    counts as that of the mounting, which it is with one mounting on each.

    Returns:
        Zeros, shape (m,) [N]; variance of their errors over σ², shape (m,); and of the
        errors that the mountings of a gear share, shape (g,).
    """
    rigs = 1 + int(rig.max())
    pairs, pair = np.unique(sums.gear * rigs + rig, return_inverse=True)
    gear, xx, xy = pairs // rigs, sums.products[:, 0, 0], sums.products[:, 0, 3]
    on_rig, of_gear = (
        np.stack([np.bincount(index, each) for each in (xx, xy)])
        for index in (pair, sums.gear)
    )
    # A gear that never moved on a rig has its slope from the others.
    xx, xy = np.where(on_rig[0] > 0.0, on_rig, of_gear[:, gear])[:, pair]
    x = sums.mean[:, 0]
    several = np.bincount(gear)[sums.gear] > 1
    shared = np.bincount(sums.gear, np.where(several, 0.0, x**2 / xx))
    return (
        sums.mean[:, 3] - xy / xx * x,
        1.0 / sums.rows + np.where(several, x**2 / xx, 0.0),
        shared / np.bincount(sums.gear),
    )


def _odd(problem: GearQuantity, values, seed: int) -> np.ndarray:
    """Return the probability of each gear being odd; zero where nothing is known."""
    known = np.any(np.asarray(problem.present) > 0.0, axis=1)
    odd = np.asarray(draw_gears(problem, values, seed).off).mean(axis=0)
    return np.where(known, odd, 0.0)
