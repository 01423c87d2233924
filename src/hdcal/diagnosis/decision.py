"""The decision: which effects act, and which share of the gap they close."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.diagnosis.acting import Acting, acting, classes
from hdcal.diagnosis.which import (
    LIKELY,
    ON_NOISE,
    Cause,
    Explanation,
    VerdictWord,
    Which,
)
from hdcal.evidence.parts import posterior
from hdcal.evidence.search import Searched
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.report.item import TAILS, Interval

# By which log evidences are divided. On learning rounds of the blind check, 940 cases,
# the mean log score grows up to 2.0, by 0.05 nat from here. Above this value fewer than
# four in five causes of gaps as large as the noise are stated with 90 %.
TEMPERATURE = 1.6
# Least p-value of an explanation that fits; from this probability on one is named.
_ADEQUATE, _NAMED = 0.01, 0.9
# Probability of the credible set, and draws of the check of an explanation.
_CREDIBLE, _DRAWS = 0.9, 300


@dataclass(frozen=True)
class Decision:
    """What a case shows about what its base model lacks.

    `gap` is the probability that something acts, `gap_N` the rms of the gap in the mean
    reading where something acts, None where no draws were made. `hypotheses` are the
    components that act, on mean and noise, with their probabilities; `explanations` are
    all, likeliest first.
    """

    gap: float
    gap_N: Interval | None
    which: Which
    explanations: tuple[Explanation, ...]
    hypotheses: Mapping[Names, float]
    coarse_step: float


def decide(
    searched: Searched, *, temperature: float = TEMPERATURE, seed: int = 0
) -> Decision:
    """Decide what acts, given the evidence of all hypotheses.

    Log evidences are divided by the temperature.
    """
    rng, table = np.random.default_rng(seed), searched.table
    chance = table.posterior(temperature)
    groups = classes(searched, chance)
    class_of = {name: group[0] for group in groups for name in group}
    found = acting(searched, chance, class_of, rng)
    on_noise = [name for name in ON_NOISE if name in searched.effects]
    groups += [(name,) for name in on_noise]
    explanations = tuple(
        Explanation(
            effects=tuple(name for name in names if name != OUTSIDE),
            outside=OUTSIDE in names,
            probability=min(chance, 1.0),
        )
        for names, chance in _summed(found, Acting.explanations)
    )
    gap = 1.0 - sum(each.probability for each in explanations if each.nothing)
    causes = [_cause(members, found, gap) for members in groups]
    causes.sort(key=lambda each: -each.probability)
    outside = _cause((OUTSIDE,), found, gap)
    likeliest = max(chance, key=lambda key: chance[key].sum())
    p_value = adequacy_p_value(searched, likeliest, rng)
    # The smallest set with the credible probability.
    total = np.cumsum([each.probability for each in explanations])
    credible = explanations[: int(np.searchsorted(total, _CREDIBLE)) + 1]
    names = [*table.names[:-1], *on_noise]
    which = Which(
        verdict=_verdict(causes, outside, gap, fits=p_value >= _ADEQUATE),
        causes=tuple(causes),
        outside=outside,
        explanations=credible,
        inclusion={name: _cause((name,), found, gap).probability for name in names},
        fits=p_value >= _ADEQUATE,
        p_value=p_value,
        not_testable=dict(searched.lacking),
    )
    return Decision(
        gap=gap,
        gap_N=_interval([(each.rms, each.weight) for each in found if each.components]),
        which=which,
        explanations=explanations,
        hypotheses=dict(_summed(found, Acting.hypotheses)),
        coarse_step=searched.coarse_step,
    )


def _verdict(
    causes: Sequence[Cause], outside: Cause, gap: float, *, fits: bool
) -> VerdictWord:
    """Return the answer in a word; classes come with the most probable first."""
    if gap <= LIKELY:
        return "none"
    likely = [cause for cause in causes if cause.probability > LIKELY]
    acting = [cause for cause in likely if not cause.on_noise]
    if not acting and outside.probability > LIKELY:
        return "unknown"
    acting = acting or likely
    if not acting or acting[0].probability < _NAMED or not fits:
        return "ambiguous"
    return "group" if acting[0].merged else "named"


def _cause(members: tuple[str, ...], found: Sequence[Acting], gap: float) -> Cause:
    """Return a class with its probability, and the share it explains of a gap."""
    these = [each for each in found if {*members} & {*each.components, each.noise}]
    samples = [
        (each.closed[members[0]], each.weight)
        for each in these
        if members[0] in each.closed
    ]
    return Cause(
        members=tuple(name for name in members if name != OUTSIDE),
        probability=min(sum(each.weight for each in these), 1.0),
        explains=_interval(samples) if gap > LIKELY else None,
    )


def _interval(samples: Sequence[tuple[np.ndarray, float]]) -> Interval | None:
    """Return the interval of samples of given total weights, None without any."""
    parts = [(x, np.full(len(x), weight / len(x))) for x, weight in samples if len(x)]
    if not parts:
        return None
    values, weights = map(np.concatenate, zip(*parts, strict=True))
    order = np.argsort(values)
    weights = weights[order] / weights.sum()
    place = np.cumsum(weights) - 0.5 * weights
    low, median, high = np.interp(TAILS, place, values[order])
    return Interval(median=float(median), lo=float(low), hi=float(high))


def _summed(
    found: Sequence[Acting], names_of: Callable[[Acting], Mapping[Names, float]]
) -> list[tuple[Names, float]]:
    """Return sets of names with their probabilities, the most probable first."""
    chance: dict[Names, float] = defaultdict(float)
    for each in found:
        for names, share in names_of(each).items():
            chance[names] += each.weight * share
    return sorted(chance.items(), key=lambda item: (-item[1], item[0]))


def adequacy_p_value(searched: Searched, key: Names, rng: np.random.Generator) -> float:
    """Return how often noise alone leaves as much structure as the readings do.

    Structure is the largest of the shares of the residuals that the kernels of the
    remainder span, each in sds of what noise makes it.
    """
    problem, noise = searched.problem, searched.table.likeliest_noise(key)
    if not searched.kernels:
        return 1.0
    fit = posterior(problem, noise, searched.table.parts[key])

    def white(curves):
        return problem.whiten(curves, noise.weight, noise.correlation)

    half = fit.factor @ white(fit.columns.T) / problem.noise_sd
    readings = white((problem.y - fit.offset)[None])
    simulated = rng.standard_normal((_DRAWS, len(problem.y)))
    errors = np.concatenate([readings, simulated])
    errors = errors - (errors @ half.T) @ half
    errors = errors / np.linalg.norm(errors, axis=1, keepdims=True)
    inside = [
        np.log(np.sum((errors @ white(kernel.columns).T) ** 2, axis=1) + 1e-300)
        for kernel in searched.kernels
    ]
    table = np.stack(inside, axis=1)
    null = table[1:]
    largest = np.max((table - null.mean(axis=0)) / null.std(axis=0), axis=1)
    return float((1 + np.sum(largest[1:] >= largest[0])) / (_DRAWS + 1))
