"""The decision: what acts, how much of the gap it closes, and what may explain it."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.acting import Acting, acting
from hdcal.diagnosis.adequacy import adequacy_p_value
from hdcal.diagnosis.likeness import classes
from hdcal.evidence.noise_models import GROWING, OUTLIERS
from hdcal.evidence.search import Searched, search
from hdcal.evidence.table import OUTSIDE, Names
from hdcal.physics.effect import Effect

# By which log posterior odds are divided. At this value the mean log score of the
# explanations of two learning sets of the blind check, 160 cases each, is largest.
TEMPERATURE = 1.3
# Probability of the credible set, and of an interval.
_CREDIBLE, _INTERVAL = 0.9, 0.95
# Probability from which on an effect is said to act, and least p-value of a fit.
_LIKELY, _ADEQUATE = 0.5, 0.01


@dataclass(frozen=True)
class Interval:
    """A median with the ends of a 95 % interval."""

    median: float
    low: float
    high: float


@dataclass(frozen=True)
class CauseClass:
    """Effects that this loading cannot separate.

    Attributes:
        members: their names, the most probable first.
        acts: probability that one of them acts, alone, in a pair or beside something
            outside the library.
        closed: share of the gap's rms that they close where they act; None for effects
            on the noise and where no draws were made.
    """

    members: tuple[str, ...]
    acts: float
    closed: Interval | None


@dataclass(frozen=True)
class Explanation:
    """One explanation of the readings.

    Attributes:
        names: effects that act, sorted; `OUTSIDE` where these close less than half of
            the gap; empty where nothing acts.
        probability: of this explanation.
    """

    names: Names
    probability: float


@dataclass(frozen=True)
class Decision:
    """What a case tells about what its base model lacks.

    Attributes:
        gap: probability that something acts.
        gap_N: rms of what acts on the mean reading, where it does [N]; None where no
            draws were made.
        classes: of effects that may act, the most probable first.
        outside: something outside the library: probability that it acts, alone or
            beside effects, and the share of the gap it closes.
        explanations: all that are possible, the most probable first.
        credible: the smallest set of explanations with 90 %.
        effects: probability that each effect acts.
        p_adequate: of a posterior predictive check of the likeliest hypothesis.
        hypotheses: probability of each hypothesis on the mean reading and effect on
            the noise.
        lacking: effects without a prediction, with the columns that were not measured.
        unexcited: effects that lack a loading which would separate them from others.
        coarse_step: step of forces that are read coarsely [N], a fact of the reading
            and no hypothesis; 0 where they are not.
    """

    gap: float
    gap_N: Interval | None
    classes: tuple[CauseClass, ...]
    outside: CauseClass
    explanations: tuple[Explanation, ...]
    credible: tuple[Explanation, ...]
    effects: Mapping[str, float]
    p_adequate: float
    hypotheses: Mapping[Names, float]
    lacking: Mapping[str, list[str]]
    unexcited: Mapping[str, list[str]]
    coarse_step: float

    @property
    def fits(self) -> bool:
        """Whether the likeliest hypothesis fits the readings."""
        return self.p_adequate >= _ADEQUATE

    @property
    def acting(self) -> tuple[CauseClass, ...]:
        """Classes that more probably act than not."""
        return tuple(each for each in self.classes if each.acts > _LIKELY)


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
        temperature: by which log posterior odds are divided.
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
    on_noise = [
        (name,) for name in (GROWING, OUTLIERS) if name in searched.predicting.effects
    ]
    causes = [_cause(members, found) for members in [*groups, *on_noise]]
    explanations = _explanations(found)
    likeliest = max(posterior, key=lambda key: posterior[key].sum())
    names = [*table.names[:-1], *(name for (name,) in on_noise)]
    chance = {each.names: each.probability for each in explanations}
    return Decision(
        gap=1.0 - chance.get((), 0.0),
        gap_N=_interval([(each.rms, each.weight) for each in found if each.components]),
        classes=tuple(sorted(causes, key=lambda each: -each.acts)),
        outside=_cause((OUTSIDE,), found),
        explanations=explanations,
        credible=_credible(explanations),
        effects={name: _cause((name,), found).acts for name in names},
        p_adequate=adequacy_p_value(searched, likeliest, rng),
        hypotheses=_hypotheses(searched, posterior),
        lacking=searched.predicting.lacking,
        unexcited=searched.predicting.unexcited,
        coarse_step=searched.coarse_step,
    )


def _cause(members: tuple[str, ...], found: Sequence[Acting]) -> CauseClass:
    """Return a class with its probability, and the share it closes."""
    these = [each for each in found if {*members} & {*each.components, each.noise}]
    samples = [
        (each.closed[members[0]], each.weight)
        for each in these
        if members[0] in each.closed
    ]
    acts = min(sum(each.weight for each in these), 1.0)
    return CauseClass(members, acts, _interval(samples))


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
    tail = 0.5 * (1.0 - _INTERVAL)
    low, median, high = np.interp((tail, 0.5, 1.0 - tail), place, values[order])
    return Interval(float(median), float(low), float(high))


def _explanations(found: Sequence[Acting]) -> tuple[Explanation, ...]:
    """Return explanations, the most probable first."""
    chance: dict[Names, float] = defaultdict(float)
    for each in found:
        for names, share in each.explanations().items():
            chance[names] += each.weight * share
    ranked = sorted(chance, key=lambda names: (-chance[names], names))
    return tuple(Explanation(names, chance[names]) for names in ranked)


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
