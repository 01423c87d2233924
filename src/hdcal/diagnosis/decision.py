"""The decision: what acts, how much of the gap it closes, and what may explain it."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.acting import Acting, acting
from hdcal.diagnosis.adequacy import adequacy_p_value
from hdcal.diagnosis.likeness import classes
from hdcal.diagnosis.which import (
    ADEQUATE,
    LIKELY,
    NAMED,
    Cause,
    Explanation,
    VerdictWord,
    Which,
)
from hdcal.evidence.noise_models import GROWING, OUTLIERS
from hdcal.evidence.search import Searched, search
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.physics.effect import Effect
from hdcal.report.item import INTERVAL, Interval

# By which log evidences are divided. On learning rounds of the blind check, 940 cases,
# the mean log score grows up to 2.0, by 0.05 nat from here. Above this value fewer than
# four in five causes of gaps as large as the noise are stated with 90 %.
TEMPERATURE = 1.6
# Probability of the credible set.
_CREDIBLE = 0.9
_ON_NOISE = (GROWING, OUTLIERS)


@dataclass(frozen=True)
class Decision:
    """What a case tells about what its base model lacks.

    Attributes:
        gap: probability that something acts.
        gap_N: rms of what acts on the mean reading, where it does [N]; None where no
            draws were made.
        which: what acts, and which share of the gap's rms it explains.
        explanations: all that are possible, the most probable first.
        hypotheses: probability of each hypothesis on the mean reading and effect on
            the noise.
        coarse_step: step of forces that are read coarsely [N], a fact of the reading
            and no hypothesis; 0 where they are not.
    """

    gap: float
    gap_N: Interval | None
    which: Which
    explanations: tuple[Explanation, ...]
    hypotheses: Mapping[Names, float]
    coarse_step: float


def decide(
    case: Case,
    library: Mapping[str, type[Effect]],
    *,
    temperature: float = TEMPERATURE,
    seed: int = 0,
) -> Decision:
    """Say what acts in a case.

    Args:
        case: gear and records.
        library: effects to consider, by name.
        temperature: by which log evidences are divided.
        seed: of the random numbers.

    Raises:
        InputError: an effect has no prior.
    """
    return decide_searched(search(case, library), temperature=temperature, seed=seed)


def decide_searched(
    searched: Searched, *, temperature: float = TEMPERATURE, seed: int = 0
) -> Decision:
    """Say what acts, given the evidence of all hypotheses."""
    rng, table = np.random.default_rng(seed), searched.table
    posterior = table.posterior(temperature)
    groups = classes(searched, posterior)
    class_of = {name: group[0] for group in groups for name in group}
    found = acting(searched, posterior, class_of, rng)
    effects = searched.predicting.effects
    groups += [(name,) for name in _ON_NOISE if name in effects]
    causes = [_cause(members, found) for members in groups]
    causes.sort(key=lambda each: -each.probability)
    explanations = _explanations(found)
    likeliest = max(posterior, key=lambda key: posterior[key].sum())
    p_value = adequacy_p_value(searched, likeliest, rng)
    gap = 1.0 - sum(each.probability for each in explanations if each.nothing)
    return Decision(
        gap=gap,
        gap_N=_interval([(each.rms, each.weight) for each in found if each.components]),
        which=_which(searched, found, causes, explanations, gap, p_value),
        explanations=explanations,
        hypotheses=_hypotheses(searched, posterior),
        coarse_step=searched.coarse_step,
    )


def _which(
    searched: Searched,
    found: Sequence[Acting],
    causes: Sequence[Cause],
    explanations: tuple[Explanation, ...],
    gap: float,
    p_value: float,
) -> Which:
    """Return what acts in a word, in classes and in explanations."""
    outside, fits = _cause((OUTSIDE,), found), p_value >= ADEQUATE
    effects = searched.predicting.effects
    names = [*searched.table.names[:-1], *(n for n in _ON_NOISE if n in effects)]
    lacking = searched.predicting.lacking
    return Which(
        verdict=_verdict(causes, outside, gap, fits),
        causes=tuple(causes),
        outside=outside,
        explanations=_credible(explanations),
        inclusion={name: _cause((name,), found).probability for name in names},
        fits=fits,
        p_value=p_value,
        not_testable={name: tuple(columns) for name, columns in lacking.items()},
    )


def _verdict(
    causes: Sequence[Cause], outside: Cause, gap: float, fits: bool
) -> VerdictWord:
    """Return the answer in a word.

    Args:
        causes: classes, the most probable first.
        outside: something outside the library.
        gap: probability that something acts.
        fits: whether the likeliest explanation fits.
    """
    if gap <= LIKELY:
        return "none"
    likely = [cause for cause in causes if cause.probability > LIKELY]
    acting = [cause for cause in likely if not cause.on_noise]
    if not acting and outside.probability > LIKELY:
        return "unknown"
    acting = acting or likely
    if not acting or acting[0].probability < NAMED or not fits:
        return "ambiguous"
    return "group" if acting[0].merged else "named"


def _cause(members: tuple[str, ...], found: Sequence[Acting]) -> Cause:
    """Return a class with its probability, and the share of the gap it explains."""
    these = [each for each in found if {*members} & {*each.components, each.noise}]
    samples = [
        (each.closed[members[0]], each.weight)
        for each in these
        if members[0] in each.closed
    ]
    return Cause(
        members=tuple(name for name in members if name != OUTSIDE),
        probability=min(sum(each.weight for each in these), 1.0),
        explains=_interval(samples),
    )


def _interval(samples: Sequence[tuple[np.ndarray, float]]) -> Interval | None:
    """Return the interval of samples of given total weights, None without any."""
    samples = [(values, weight) for values, weight in samples if len(values)]
    if not samples:
        return None
    values = np.concatenate([values for values, _ in samples])
    weights = np.concatenate(
        [np.full(len(values), weight / len(values)) for values, weight in samples]
    )
    order = np.argsort(values)
    weights = weights[order] / weights.sum()
    place = np.cumsum(weights) - 0.5 * weights
    tail = 0.5 * (1.0 - INTERVAL)
    low, median, high = np.interp((tail, 0.5, 1.0 - tail), place, values[order])
    return Interval(median=float(median), lo=float(low), hi=float(high))


def _explanations(found: Sequence[Acting]) -> tuple[Explanation, ...]:
    """Return explanations, the most probable first."""
    chance: dict[Names, float] = defaultdict(float)
    for each in found:
        for names, share in each.explanations().items():
            chance[names] += each.weight * share
    ranked = sorted(chance, key=lambda names: (-chance[names], names))
    return tuple(
        Explanation(
            effects=tuple(name for name in names if name != OUTSIDE),
            outside=OUTSIDE in names,
            probability=min(chance[names], 1.0),
        )
        for names in ranked
    )


def _credible(explanations: tuple[Explanation, ...]) -> tuple[Explanation, ...]:
    """Return the smallest set with the credible probability."""
    total = np.cumsum([each.probability for each in explanations])
    return explanations[: int(np.searchsorted(total, _CREDIBLE)) + 1]


def _hypotheses(
    searched: Searched, posterior: Mapping[Names, np.ndarray]
) -> dict[Names, float]:
    """Return the probability of components on the mean with effects on the noise."""
    chance: dict[Names, float] = defaultdict(float)
    for key, row in posterior.items():
        for noise, each in zip(searched.table.noises, row, strict=True):
            names = (*key, noise.name) if noise.name else key
            chance[tuple(sorted(names))] += float(each)
    return dict(chance)
