"""Does the likeliest cause leave only noise? If not, less is said of it.

Evidence compares hypotheses with each other; all of them may be wrong. So the residual
test is repeated on the readings beside the likeliest hypothesis, its shape free to
differ as far as evidence allows. It moves no probability.
"""

import numpy as np
from scipy.special import betainc, betaln

from hdcal.data.case import Case
from hdcal.diagnosis.where import declared_directions
from hdcal.evidence.case_evidence import NONE, QUANTISATION, UNKNOWN, CaseEvidence
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.linear_rows import whiten
from hdcal.evidence.prepare import with_relative_noise
from hdcal.evidence.remainder_evidence import beside_effects
from hdcal.evidence.residual_test import residual_test

# Draws of pure noise for one hypothesis.
_DRAWS = 600
# Readings with a noise this much larger than the middle one are noisy.
_NOISY = 1.2
# A hypothesis with a smaller p-value, or noise in bursts of higher odds, leaves more
# than noise.
_LEAST, _BURSTS = 0.01, 10.0


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
    if _burst_odds(evidence, names, correlation) > _BURSTS:
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


def _burst_odds(evidence: CaseEvidence, names: list[str], correlation: float) -> float:
    """Return the odds that noisy readings came in bursts, against one by one.

    Noise, whatever its size in each row, has a sign of its own in each: neighbours
    among the readings that a hypothesis takes to be noisy agree as often as not. In a
    burst they agree with a probability that is uniform from one half to one.
    """
    odds = 1.0
    for name in names:
        if name not in evidence.noise:
            continue
        relative = evidence.noise[name].relative_sd
        rows = with_relative_noise(evidence.prepared, relative).rows
        fit = fit_design(
            rows, design_of(evidence, names), evidence.prepared.noise_sd, correlation
        )
        # Serial correlation alone makes neighbours agree.
        error = whiten(rows, rows.reading - fit.predict(), correlation)
        noisy = relative > _NOISY * np.median(relative)
        before = rows.before
        both = noisy & (before >= 0) & noisy[before]
        same = int(np.sum(both & (error * error[before] > 0.0)))
        pairs = int(np.sum(both))
        odds *= sign_odds(same, pairs)
    return odds


def sign_odds(same: int, pairs: int) -> float:
    """Return the odds of dependent against independent signs.

    Args:
        same: pairs of neighbours that agree.
        pairs: of neighbours in all.
    """
    other = pairs - same
    whole = betaln(same + 1, other + 1) + np.log(betainc(other + 1, same + 1, 0.5))
    return float(np.exp(whole + (pairs + 1) * np.log(2.0)))
