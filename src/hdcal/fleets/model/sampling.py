"""Draws of a population: by importance sampling, or by NUTS where that fails."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hdcal.inference import laplace
from hdcal.inference.checks import Check, mixing_checks, sampling_checks
from hdcal.inference.diagnostics import mixing
from hdcal.inference.importance import MAX_SHAPE, sample_by_importance
from hdcal.inference.sample import Progress, sample
from hdcal.inference.sampled_problem import Sampled


@dataclass(frozen=True)
class Sampling:
    """Settings of the samplers.

    Attributes:
        chains: independent chains, two or more.
        warmup: iterations of adaptation per chain, where NUTS draws.
        draws: kept per chain.
        seed: of all random numbers.
        progress: called with (steps done, steps in all).
    """

    chains: int = 4
    warmup: int = 500
    draws: int = 800
    seed: int = 0
    progress: Progress | None = None

    def run(
        self, name: str, problem: Sampled, start: Mapping[str, float]
    ) -> tuple[dict[str, np.ndarray], tuple[Check, ...]]:
        """Return draws by site, of all chains, and the checks of the sampler.

        The name of the quantity is put before each check; `start` has rough values.
        """
        whitening = laplace.fit(problem, start)
        size = {"chains": self.chains, "draws": self.draws, "progress": self.progress}
        cheap = sample_by_importance(problem, whitening, self.seed, **size)
        if cheap is not None:
            values = cheap.values
            checks = (
                *mixing_checks(mixing(_free(values, problem)), self.chains),
                _coverage(cheap.shape),
            )
        else:
            found = sample(problem, whitening, self.seed, warmup=self.warmup, **size)
            # A run may be longer than asked for: all quantities have as many draws.
            longer = next(iter(found.values.values())).shape[1]
            kept = np.linspace(0, longer - 1, self.draws).round().astype(int)
            values = {site: v[:, kept] for site, v in found.values.items()}
            checks = sampling_checks(found, mixing(_free(found.values, problem)))
        named = [replace(one, name=f"{name}: {one.name}") for one in checks]
        return {site: v.reshape(-1) for site, v in values.items()}, tuple(named)


def _coverage(shape: float) -> Check:
    """Return how well the proposals cover the posterior."""
    words = f"the largest weights have a Pareto k of {shape:.2f}, allowed {MAX_SHAPE}"
    outcome = "passed" if shape <= MAX_SHAPE else "failed"
    return Check("proposals cover the posterior (Pareto k)", outcome, words)


def _free(values: Mapping[str, np.ndarray], problem: Sampled) -> dict[str, np.ndarray]:
    fixed = {n for n, prior in problem.priors.items() if prior.family == "fixed"}
    return {name: v for name, v in values.items() if name not in fixed}
