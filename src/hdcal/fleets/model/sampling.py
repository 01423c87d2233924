"""Draws of populations: by importance sampling, or by NUTS where that fails."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdcal.fleets.model.gear_noise import GearNoise
from hdcal.fleets.model.gear_quantity import GearQuantity
from hdcal.inference import laplace
from hdcal.inference.checks import Check, mixing_checks, sampling_checks
from hdcal.inference.diagnostics import mixing
from hdcal.inference.importance import MAX_SHAPE, sample_by_importance
from hdcal.inference.sample import Progress, sample

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
    """Draws by site and checks of the populations of a fleet that were sampled so far.

    The quantities are named in the order in which they are sampled.
    """

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
        """Sample the population of a quantity, and return so many of its draws.

        Sites in `start` are roughly known.
        """
        how, problem = self._sampling, problem.some(self._chosen)
        free = {n for n, prior in problem.priors.items() if prior.family != "fixed"}
        start = {site: value for site, value in start.items() if site in free}
        whitening = laplace.fit(problem, start)
        progress = self._progress(name)
        size = {"chains": how.chains, "draws": how.draws, "progress": progress}
        cheap = sample_by_importance(problem, whitening, how.seed, **size)
        if cheap is not None:
            values = cheap.values
            checks = (
                *mixing_checks(_mixing(values, problem), how.chains),
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
            checks = sampling_checks(found, _mixing(found.values, problem))
        self.checks += [replace(one, name=f"{name}: {one.name}") for one in checks]
        flat = {site: value.reshape(-1) for site, value in values.items()}
        for site, value in flat.items():
            plain = site if site.startswith(_GROUPS) else f"{name}_{site}"
            self.draws[_SITES[name].get(site, plain)] = value
        step = -(-how.chains * how.draws // many)
        return {site: value[::step] for site, value in flat.items()}

    def _progress(self, name: str) -> Progress | None:
        """Return a progress of one quantity, as a part of that of all quantities."""
        whole, every = self._sampling.progress, len(self._names)
        if whole is None:
            return None
        before = self._names.index(name)
        return lambda done, total: whole(before * total + done, every * total)


def _mixing(values: Mapping[str, np.ndarray], problem: GearNoise | GearQuantity):
    fixed = {n for n, prior in problem.priors.items() if prior.family == "fixed"}
    return mixing({name: v for name, v in values.items() if name not in fixed})
