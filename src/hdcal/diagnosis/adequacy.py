"""Does the likeliest cause leave only noise? If not, less is said of it.

Evidence compares hypotheses with each other; all of them may be wrong. So the residual
test is repeated on the readings beside the likeliest hypothesis, its shape free to
differ as far as evidence allows. It moves no probability.
"""

import numpy as np

from hdcal.data.case import Case
from hdcal.diagnosis.where import declared_directions
from hdcal.evidence.bursts import BURSTS, burst_odds
from hdcal.evidence.case_evidence import NONE, QUANTISATION, UNKNOWN, CaseEvidence
from hdcal.evidence.prepare import with_relative_noise
from hdcal.evidence.remainder_evidence import beside_effects
from hdcal.evidence.residual_test import residual_test

# Draws of pure noise for one hypothesis.
_DRAWS = 600
# A hypothesis with a smaller p-value leaves more than noise.
_LEAST = 0.01


def leaves_more_than_noise(
    evidence: CaseEvidence,
    hypothesis: str,
    case: Case,
    correlation: float,
    rng: np.random.Generator,
) -> bool:
    """Tell whether something is left beside a hypothesis that holds nothing unknown.

    Args:
        evidence: of the case.
        hypothesis: effects joined with +.
        case: for its labels.
        correlation: AR(1) coefficient of the noise.
        rng: of the draws of pure noise.
    """
    names = hypothesis.split("+")
    # Rounding in steps above the noise leaves a pattern that is no effect.
    if {NONE, UNKNOWN, QUANTISATION} & {*names}:
        return False
    for noise in {*names} & evidence.noise.keys():
        relative = evidence.noise[noise].relative_sd
        if burst_odds(evidence, names, relative, correlation)[0] > BURSTS:
            return True
    return _p_value(evidence, names, case, correlation, rng) < _LEAST


def _p_value(
    evidence: CaseEvidence, names: list[str], case: Case, correlation: float, rng
) -> float:
    """Return the p-value of the mean beside a hypothesis at its best fit."""
    prepared = beside_effects(evidence, names)
    for name in names:
        if name in evidence.noise:
            noise = evidence.noise[name].relative_sd
            prepared = with_relative_noise(prepared, noise)
    _, directions = declared_directions(evidence, case)
    tested = residual_test(prepared, correlation, directions, rng, draws=_DRAWS)
    return tested.mean_p_value
