"""Evidence of each cause from the readings of one gear alone."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from hdcal.data.case import Case
from hdcal.data.scatter import require_scatter
from hdcal.diagnosis.acting import CARRIED, DRAWS, NEGLIGIBLE, share_closed
from hdcal.errors import Finding, Findings, quoted
from hdcal.evidence.noise_models import PRIOR_ODDS
from hdcal.evidence.parts import sampled_curves
from hdcal.evidence.row_features import take_rows
from hdcal.evidence.search import Searched, search
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.physics.effect import Effect

NONE = "none"
# Fewer rows than these beside the parameters of a line with an offset for each run
# cannot separate causes from noise.
_FEWEST_LEFT = 8
# Range of the probability that effects close half of the gap.
_RANGE = (1e-3, 1.0 - 1e-3)


class Weight(NamedTuple):
    """Evidence of one cause.

    Attributes:
        log_evidence: of the readings of a gear [nat].
        log_prior: log of the probability before the readings.
    """

    log_evidence: float
    log_prior: float


def gears_of(case: Case) -> list[Case]:
    """Return the rows of each gear as a case."""
    return [_one_gear(case, gear) for gear in range(len(case.specimen_labels))]


def _one_gear(case: Case, gear: int) -> Case:
    records = take_rows(case.records, np.flatnonzero(case.records.specimen == gear))
    kept, run = np.unique(records.run, return_inverse=True)
    label = case.specimen_labels[gear]
    known = records.known - {"run", "runs", "specimen", "specimens"}
    return replace(
        case,
        name=f"{case.name}, gear {quoted(label)}",
        records=replace(
            records, run=run, specimen=np.zeros(len(run), int), known=known
        ),
        run_labels=tuple(case.run_labels[each] for each in kept),
        specimen_labels=(label,),
        lots=(),
        operators=(),
        rigs=(),
        dates=(),
    )


def unusable(gears: Sequence[Case]) -> dict[str, Finding]:
    """Return gears whose readings cannot show a cause, each with the reason."""
    bad = {}
    for gear in gears:
        wrong, rows, runs = Findings(), len(gear.records.force), len(gear.run_labels)
        needed = _FEWEST_LEFT + 1 + runs
        if rows < needed:
            words = f"has {rows} rows in {runs} run{'s' if runs > 1 else ''}, too few"
            remedy = f"Read it {needed} times or more, or leave it out"
            wrong.append(Finding(gear.name, words, remedy))
        else:
            wrong.attempt(require_scatter, gear)
        bad |= {gear.specimen_labels[0]: wrong[0]} if wrong else {}
    return bad


# Thousands of small systems are solved, over which threads only wait for each other.
@threadpool_limits.wrap(limits=1, user_api="blas")
def weigh_gear(
    place: int, gear: Case, library: Mapping[str, type[Effect]], seed: int
) -> tuple[int, dict[str, Weight]]:
    """Return the place of a gear and the evidence of each cause.

    The force offsets of runs are integrated out in every hypothesis.

    Args:
        place: index of the gear.
        gear: its rows.
        library: effects to consider, by name.
        seed: of the draws.
    """
    searched = search(gear, library, free_runs=True)
    return place, by_cause(searched, np.random.default_rng(seed))


def by_cause(searched: Searched, rng: np.random.Generator) -> dict[str, Weight]:
    """Return the evidence of each cause: the mean over its hypotheses.

    Each of the effects of a pair is the cause in half of the prior probability.
    Effects beside something outside the library are the cause where they close half
    of the gap. An effect on the noise is the cause where nothing acts on the mean.
    """
    table, parts = searched.table, defaultdict(list)
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
                each = prior + np.log(before), evidence + np.log(change)
                parts[cause].append(each)
    return {cause: _mean(np.array(each)) for cause, each in parts.items()}


def _mean(hypotheses: np.ndarray) -> Weight:
    """Return the mean evidence of hypotheses, given log priors and log evidences."""
    prior = np.logaddexp.reduce(hypotheses[:, 0])
    joint = np.logaddexp.reduce(hypotheses.sum(axis=1))
    return Weight(float(joint - prior), float(prior))


def _shares(
    searched: Searched, key: Names, rng: np.random.Generator | None
) -> dict[str, tuple[float, float]]:
    """Return the share of a hypothesis that each cause has before the readings.

    And the factor by which the readings change it.

    Args:
        searched: hypotheses of the gear.
        key: components of the hypothesis.
        rng: source of randomness; None leaves the shares as they are before.
    """
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
