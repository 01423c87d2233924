"""From evidences to a posterior over hypotheses."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.evidence.case_evidence import NONE, UNKNOWN, CaseEvidence, with_remainder

# Prior probabilities of none, unknown, all effects with a remainder and all pairs;
# the effects alone share the rest.
PRIOR_NONE, PRIOR_UNKNOWN, PRIOR_REMAINDER, PRIOR_PAIRS = 0.5, 0.1, 0.15, 0.03
# Odds of each effect on the noise, whatever goes on in the mean.
PRIOR_NOISE = 0.02
NAMED = 0.9
# An effect gets its own name from here on. Chosen among five on opened blind checks;
# what such names are worth, fresh ones say, see `naming`.
SURE = 0.97
# An effect is the cause where it closes this share of the gap; below it something
# unknown is, with the effect beside it.
CARRIES = 0.7


@dataclass(frozen=True)
class ModelPosterior:
    """Posterior over hypotheses.

    Attributes:
        probabilities: of each hypothesis; sum to 1.
        inclusion: of each effect over all hypotheses that hold it.
        correlation: posterior over the AR(1) coefficients, shape (r,).
        log_evidence: relative to none [nat].
    """

    probabilities: dict[str, float]
    inclusion: dict[str, float]
    correlation: np.ndarray
    log_evidence: dict[str, float]

    @property
    def top(self) -> str:
        """Most probable hypothesis."""
        return max(self.probabilities, key=lambda name: self.probabilities[name])

    @property
    def smallest_set(self) -> tuple[str, ...]:
        """Effects of the smallest set of hypotheses with 90 %, likeliest first."""
        found: list[str] = []
        total = 0.0
        for name, share in sorted(self.probabilities.items(), key=lambda kv: -kv[1]):
            parts = [n for n in name.split("+") if n != UNKNOWN or name == UNKNOWN]
            found += [part for part in parts if part not in found]
            total += share
            if total >= NAMED:
                break
        return tuple(found)


def log_priors(names: Sequence[str], noise: Iterable[str] = ()) -> np.ndarray:
    """Return the log prior probability of each hypothesis; they sum to 1.

    Args:
        names: none, unknown, effects, and with + pairs and effects with a remainder.
        noise: which of the effects are on the noise.
    """
    noise = {*noise}
    shares = {
        "none": PRIOR_NONE,
        "unknown": PRIOR_UNKNOWN,
        "remainder": PRIOR_REMAINDER,
        "pair": PRIOR_PAIRS,
        "effect": 1.0 - PRIOR_NONE - PRIOR_UNKNOWN - PRIOR_REMAINDER - PRIOR_PAIRS,
    }
    parts = [{*name.split("+")} for name in names]
    kinds = [_kind(each - noise) for each in parts]
    counts = Counter(
        kind for kind, each in zip(kinds, parts, strict=True) if not each & noise
    )
    # Effects beside which no remainder was looked for have none of that prior.
    counts["remainder"] = max(counts["effect"], counts["remainder"])
    prior = np.array(
        [
            shares[kind] / max(counts[kind], 1) * PRIOR_NOISE ** len(each & noise)
            for kind, each in zip(kinds, parts, strict=True)
        ]
    )
    return np.log(prior / prior.sum())


def _kind(mean: set[str]) -> str:
    """Return which kind of hypothesis on the mean this is."""
    if not mean or mean == {NONE}:
        return "none"
    if UNKNOWN in mean:
        return "unknown" if len(mean) == 1 else "remainder"
    return "effect" if len(mean) == 1 else "pair"


def model_posterior(
    table: Mapping[str, np.ndarray],
    carried: Mapping[str, float] | None = None,
    noise: Iterable[str] = (),
    unseen: Mapping[str, Mapping[str, float]] | None = None,
) -> ModelPosterior:
    """Return the posterior over hypotheses.

    Args:
        table: log evidence of each by AR(1) coefficient, all of which are equally
            probable before the data.
        carried: of an effect with a remainder, the probability that the effect carries
            the gap; as far as it does not, the cause is unknown.
        noise: which of the effects are on the noise.
        unseen: of a pair, how probably each of its effects acts alone, the other one
            being too small to be seen; at most 1 in all.
    """
    names = list(table)
    prior = log_priors(names, noise)[:, None]
    joint = np.stack([table[name] for name in names]) + prior
    joint = np.exp(joint - np.max(joint))
    joint = joint / joint.sum()
    share = dict(zip(names, joint.sum(axis=1).tolist(), strict=True))
    for effect, chance in (carried or {}).items():
        name = with_remainder(effect)
        share[UNKNOWN] += (1.0 - chance) * share[name]
        share[name] *= chance
    for pair, alone in (unseen or {}).items():
        for effect, chance in alone.items():
            share[effect] += chance * share[pair]
        share[pair] *= 1.0 - sum(alone.values())
    effects = [n for n in names if n not in (NONE, UNKNOWN) and "+" not in n]
    whole = {n: float(np.logaddexp.reduce(v)) for n, v in table.items()}
    return ModelPosterior(
        share,
        _inclusion(share, effects),
        joint.sum(axis=0),
        {name: value - whole[NONE] for name, value in whole.items()},
    )


def posterior_of(evidence: CaseEvidence) -> ModelPosterior:
    """Return the posterior over the hypotheses of a case."""
    return model_posterior(
        evidence.table, carried(evidence), evidence.on_noise, evidence.unseen
    )


def carried(evidence: CaseEvidence) -> dict[str, float]:
    """Return the probability that each effect carries the gap beside a remainder."""
    return {n: float(np.mean(c >= CARRIES)) for n, c in evidence.closed.items()}


def _inclusion(share: Mapping[str, float], effects: Iterable[str]) -> dict[str, float]:
    """Return the probability of each effect over all hypotheses that hold it."""
    found = dict.fromkeys(effects, 0.0)
    for name, chance in share.items():
        for effect in found.keys() & name.split("+"):
            found[effect] += chance
    return found
