"""The posterior of a fleet: the population of each quantity, and every gear in it.

The noise comes first: in the other quantities, which hold next to nothing about it, it
is integrated over.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from hdcal.fleets.model.gear_noise import GearNoise, gear_noise
from hdcal.fleets.model.gear_quantity import MOST_FALSE, GearQuantity, draw_gears
from hdcal.fleets.model.groups import group_offsets
from hdcal.fleets.model.line_fits import LineFits, line_fits
from hdcal.fleets.model.quantities import (
    FleetGroups,
    Problems,
    noise_problem,
    population_priors,
)
from hdcal.fleets.reading.readings import FleetReadings, MountingSums
from hdcal.inference import laplace
from hdcal.inference.checks import Check, mixing_checks, sampling_checks
from hdcal.inference.diagnostics import mixing
from hdcal.inference.importance import MAX_SHAPE, sample_by_importance
from hdcal.inference.sample import Progress, sample
from hdcal.report.item import TAILS

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
# many, which determine its scatter to 1 %.
MOST_SAMPLED = 5_000
_SHAPES = ("loop", "bend")
# Fewest gears that tell how much their loops or bends differ.
_FEWEST = 3
# Draws of the population over which the noise of gears and their probability of being
# outliers is averaged.
_AVERAGED = 100
# Draws of the population for which every gear is drawn too: more for few gears, up to
# a million in all, and at most as many as memory holds.
_GEAR_DRAWS, _IN_ALL, _MOST_DRAWN = 400, 1_000_000, 20_000_000


@dataclass(frozen=True)
class Sampling:
    """Settings of the samplers, as `hdcal.fleet` has them."""

    chains: int = 4
    warmup: int = 500
    draws: int = 800
    seed: int = 0
    progress: Progress | None = None

    @property
    def settings(self) -> dict[str, int]:
        """Settings that a result states."""
        names = ("seed", "chains", "warmup", "draws")
        return {name: getattr(self, name) for name in names}


class Populations:
    """Draws by site and checks of the populations that were sampled so far."""

    def __init__(self, sampling: Sampling, gears: int, names: Sequence[str]):
        rng = np.random.default_rng(sampling.seed)
        self._sampling, self._names = sampling, names
        self._chosen = np.sort(rng.permutation(gears)[:MOST_SAMPLED])
        self.draws: dict[str, np.ndarray] = {}
        self.checks: list[Check] = []

    def sample(
        self,
        name: str,
        problem: GearNoise | GearQuantity,
        start: Mapping[str, float],
        many: int,
    ) -> dict[str, np.ndarray]:
        """Sample the population of a quantity from a start, and return many draws."""
        how, problem = self._sampling, problem.some(self._chosen)
        fixed = {n for n, prior in problem.priors.items() if prior.family == "fixed"}
        start = {site: value for site, value in start.items() if site not in fixed}
        whitening = laplace.fit(problem, start)
        size: dict[str, Any] = {"chains": how.chains, "draws": how.draws}
        cheap = sample_by_importance(problem, whitening, how.seed, **size)
        if cheap is not None:
            values = cheap.values
            checks = (
                *mixing_checks(_mixing(values, fixed), how.chains),
                Check(
                    "proposals cover the posterior (Pareto k)",
                    "passed" if cheap.shape <= MAX_SHAPE else "failed",
                    f"the largest weights have a Pareto k of {cheap.shape:.2f}, "
                    f"allowed {MAX_SHAPE}",
                ),
            )
        else:
            found = sample(problem, whitening, how.seed, warmup=how.warmup, **size)
            # A run may be longer than asked for: all quantities have as many draws.
            longer = next(iter(found.values.values())).shape[1]
            kept = np.linspace(0, longer - 1, how.draws).round().astype(int)
            values = {site: v[:, kept] for site, v in found.values.items()}
            checks = sampling_checks(found, _mixing(found.values, fixed))
        self.checks += [replace(c, name=f"{name}: {c.name}") for c in checks]
        flat = {site: value.reshape(-1) for site, value in values.items()}
        for site, value in flat.items():
            plain = site if site.startswith(_GROUPS) else f"{name}_{site}"
            self.draws[_SITES[name].get(site, plain)] = value
        if how.progress is not None:
            how.progress(1 + self._names.index(name), len(self._names))
        step = -(-how.chains * how.draws // many)
        return {site: value[::step] for site, value in flat.items()}


def _mixing(values: Mapping[str, np.ndarray], fixed: set[str]):
    return mixing({name: v for name, v in values.items() if name not in fixed})


@dataclass(frozen=True)
class FittedFleet:
    """Posterior of a population and of its gears, at the sizes of the gear file.

    Attributes:
        draws: of the population by site, shape (d,).
        gears: one row a gear, its columns as in gears.csv.
        stiffness: draws of each gear, shape (t, g) [N/mm as read].
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

    With the variance over σ² of its error, (m,), and of the errors that the mountings
    of a gear share, (g,). Mountings of a gear on one rig share the error of the slope;
    on several rigs it counts as that of the mounting, which it is with one on each.
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
    """Return the probability of each gear being an outlier, 0 where not known."""
    known = np.any(np.asarray(problem.present) > 0.0, axis=1)
    odd = np.asarray(draw_gears(problem, values, seed).off).mean(axis=0)
    return np.where(known, odd, 0.0)
