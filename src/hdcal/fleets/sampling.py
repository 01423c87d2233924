"""Draws of the population: by importance sampling, or by NUTS where these fail."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hdcal.data.prior import Prior
from hdcal.fleets.population_problem import PopulationProblem
from hdcal.inference import laplace
from hdcal.inference.checks import Check, mixing_checks, sampling_checks
from hdcal.inference.diagnostics import mixing
from hdcal.inference.importance import MAX_SHAPE, sample_by_importance
from hdcal.inference.sample import Progress, sample


class SampledPopulation(NamedTuple):
    """Draws by site, and what is said of them.

    Attributes:
        values: of each site, of all chains, shape (d,).
        checks: of the sampler.
        sampler: its name.
    """

    values: dict[str, np.ndarray]
    checks: tuple[Check, ...]
    sampler: str


def sample_population(
    problem: PopulationProblem,
    start: Mapping[str, float],
    seed: int,
    *,
    chains: int,
    warmup: int,
    draws: int,
    progress: Progress | None,
) -> SampledPopulation:
    """Return draws of the population.

    Args:
        problem: the gears.
        start: sites whose value is roughly known, where to look first.
        seed: the same one gives the same draws.
        chains: chains of draws.
        warmup: iterations of adaptation per chain, where NUTS draws.
        draws: of each chain.
        progress: called with (steps done, steps in all).
    """
    whitening = laplace.fit(problem, start)
    size = {"chains": chains, "draws": draws, "progress": progress}
    cheap = sample_by_importance(problem, whitening, seed, **size)
    if cheap is not None:
        mixed = mixing(_free(cheap.values, problem.priors))
        checks = (*mixing_checks(mixed, chains), _covering(cheap.shape))
        return SampledPopulation(_flat(cheap.values), checks, "importance sampling")
    found = sample(problem, whitening, seed, warmup=warmup, **size)
    mixed = mixing(_free(found.values, problem.priors))
    checks = sampling_checks(found, mixed)
    return SampledPopulation(_flat(found.values), checks, "NUTS")


def _covering(shape: float) -> Check:
    """Return how well proposals follow the posterior."""
    words = f"the largest weights have a Pareto k of {shape:.2f}, allowed {MAX_SHAPE}"
    outcome = "passed" if shape <= MAX_SHAPE else "failed"
    return Check("proposals cover the posterior (Pareto k)", outcome, words)


def _free(values: Mapping[str, np.ndarray], priors: Mapping[str, Prior]):
    fixed = {name for name, prior in priors.items() if prior.family == "fixed"}
    return {name: v for name, v in values.items() if name not in fixed}


def _flat(values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: v.reshape(-1) for name, v in values.items()}
