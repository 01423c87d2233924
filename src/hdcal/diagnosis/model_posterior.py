"""From evidences to a posterior over hypotheses, and from there to a verdict."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hdcal.diagnosis.verdict import VerdictWord
from hdcal.evidence.case_evidence import NONE, UNKNOWN

# Prior probabilities of none, unknown and all pairs; the effects share the rest.
PRIOR_NONE, PRIOR_UNKNOWN, PRIOR_PAIRS = 0.5, 0.1, 0.03
NAMED = 0.9


@dataclass(frozen=True)
class ModelPosterior:
    """Posterior over hypotheses.

    Attributes:
        probabilities: of each hypothesis; sum to 1.
        inclusion: of each effect over singles and pairs.
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
            found += [part for part in name.split("+") if part not in found]
            total += share
            if total >= NAMED:
                break
        return tuple(found)


def log_priors(names: list[str]) -> np.ndarray:
    """Return the log prior probability of each hypothesis; they sum to 1.

    Args:
        names: none, unknown, effects, and pairs joined with +.
    """
    pairs = sum("+" in name for name in names)
    singles = len(names) - pairs - 2
    free = 1.0 - PRIOR_NONE - PRIOR_UNKNOWN - PRIOR_PAIRS

    def chance(name: str) -> float:
        if name in (NONE, UNKNOWN):
            return PRIOR_NONE if name == NONE else PRIOR_UNKNOWN
        return PRIOR_PAIRS / pairs if "+" in name else free / singles

    prior = np.array([chance(name) for name in names])
    return np.log(prior / prior.sum())


def model_posterior(table: Mapping[str, np.ndarray]) -> ModelPosterior:
    """Return the posterior over hypotheses.

    Args:
        table: log evidence of each by AR(1) coefficient, all of which are equally
            probable before the data.
    """
    names = list(table)
    joint = np.stack([table[name] for name in names]) + log_priors(names)[:, None]
    joint = np.exp(joint - np.max(joint))
    joint = joint / joint.sum()
    share = dict(zip(names, joint.sum(axis=1).tolist(), strict=True))
    effects = [n for n in names if n not in (NONE, UNKNOWN) and "+" not in n]
    whole = {n: float(np.logaddexp.reduce(v)) for n, v in table.items()}
    return ModelPosterior(
        share,
        _inclusion(share, effects),
        joint.sum(axis=0),
        {name: value - whole[NONE] for name, value in whole.items()},
    )


def _inclusion(share: Mapping[str, float], effects: Iterable[str]) -> dict[str, float]:
    """Return the probability of each effect over singles and pairs."""
    return {
        effect: sum((p for n, p in share.items() if effect in n.split("+")), 0.0)
        for effect in effects
    }


def move_to_unknown(
    posterior: ModelPosterior, kept: Mapping[str, float]
) -> ModelPosterior:
    """Return the posterior with a part of some hypotheses moved to unknown.

    Args:
        posterior: over hypotheses.
        kept: share of its probability that a hypothesis keeps, by name.
    """
    share = {n: p * kept.get(n, 1.0) for n, p in posterior.probabilities.items()}
    share[UNKNOWN] += sum(posterior.probabilities.values()) - sum(share.values())
    inclusion = _inclusion(share, posterior.inclusion)
    return replace(posterior, probabilities=share, inclusion=inclusion)


def verdict_word(posterior: ModelPosterior, detected: bool) -> VerdictWord:
    """Return the verdict in one word."""
    share = posterior.probabilities
    if not detected or share[NONE] >= 0.5:
        return "none"
    if posterior.top == UNKNOWN:
        return "unknown"
    return (
        "named"
        if max(posterior.inclusion.values(), default=0.0) >= NAMED
        else "ambiguous"
    )
