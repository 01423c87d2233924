"""Evidence of each cause in the readings of one gear."""

from collections import defaultdict
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from hdcal.data.case import Case
from hdcal.diagnosis.acting import CARRIED, DRAWS, NEGLIGIBLE, share_closed
from hdcal.errors import Finding, InputError
from hdcal.evidence.noise_models import PRIOR_ODDS
from hdcal.evidence.parts import sampled_curves
from hdcal.evidence.search import Searched, search
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.physics.effect import Effect

NONE = "none"
# Range of the probability that effects close half of the gap.
_RANGE = (1e-3, 1.0 - 1e-3)


class Weight(NamedTuple):
    """Log evidence of one cause in the readings of a gear [nat], and its log prior."""

    log_evidence: float
    log_prior: float


# Thousands of small systems are solved, over which threads only wait for each other.
@threadpool_limits.wrap(limits=1, user_api="blas")
def weigh_gear(
    gear: Case, library: Mapping[str, type[Effect]], seed: int
) -> dict[str, Weight] | Finding:
    """Return the evidence of each cause, offsets of runs integrated out, or a fault."""
    try:
        searched = search(gear, library, free_runs=True)
        weights = by_cause(searched, np.random.default_rng(seed))
        if not np.all(np.isfinite([*weights.values()])):
            raise ArithmeticError("it is not finite")
    except InputError as error:
        return error.findings[0]
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        remedy = "Leave the gear out, or diagnose it alone"
        return Finding(gear.name, f"its evidence cannot be computed ({error})", remedy)
    return weights


def by_cause(searched: Searched, rng: np.random.Generator) -> dict[str, Weight]:
    """Return the evidence of each cause: the mean over its hypotheses.

    Each of the effects of a pair is the cause in half of the prior probability.
    Effects with a remainder outside the library are the cause where they close half of
    the gap. An effect on the noise is the cause where nothing acts on the mean.
    """
    table, found = searched.table, defaultdict(list)
    posterior = table.posterior()
    for key, row in table.log_evidence.items():
        drawn = posterior[key].sum() >= NEGLIGIBLE
        shares = _shares(searched, key, rng if drawn else None)
        for noise in {model.name for model in table.noises}:
            same = [model.name == noise for model in table.noises]
            # The evidences contain the prior odds of the noise.
            odds = np.log(PRIOR_ODDS) if noise else 0.0
            prior = table.log_prior(key) + odds
            evidence = np.logaddexp.reduce(row[same]) - odds
            causes = {noise: (1.0, 1.0)} if noise and not key else shares
            for cause, (before, change) in causes.items():
                found[cause].append((prior + np.log(before), evidence + np.log(change)))
    return {cause: _mean(np.array(each)) for cause, each in found.items()}


def _mean(hypotheses: np.ndarray) -> Weight:
    """Return the mean evidence of hypotheses, given log priors and log evidences."""
    prior = np.logaddexp.reduce(hypotheses[:, 0])
    joint = np.logaddexp.reduce(hypotheses.sum(axis=1))
    return Weight(float(joint - prior), float(prior))


def _shares(
    searched: Searched, key: Names, rng: np.random.Generator | None
) -> dict[str, tuple[float, float]]:
    """Return each cause's prior share of a hypothesis, and the factor of readings."""
    effects = [name for name in key if name != OUTSIDE]
    if OUTSIDE not in key or not effects:
        return {name: (1.0 / len(key), 1.0) for name in key} or {NONE: (1.0, 1.0)}
    chance = 0.5 if rng is None else _carried(searched, key, rng)
    split = {name: (0.5 / len(effects), 2.0 * chance) for name in effects}
    return split | {OUTSIDE: (0.5, 2.0 * (1.0 - chance))}


def _carried(searched: Searched, key: Names, rng: np.random.Generator) -> float:
    """Return the probability that effects close half of the gap."""
    table = searched.table
    parts, noise = table.parts[key], table.likeliest_noise(key)
    curves = sampled_curves(searched.problem, noise, parts, DRAWS, rng)
    effects = [
        curve
        for part, curve in zip(parts, curves.own, strict=True)
        if table.names[part.component] != OUTSIDE
    ]
    chance = np.mean(share_closed(curves.whole.sum(axis=0), effects) >= CARRIED)
    return float(np.clip(chance, *_RANGE))
