"""Does the likeliest cause leave only noise? If not, less is said of it.

Evidence compares hypotheses with each other; all of them may be wrong. So the residual
test is repeated on the readings beside the likeliest hypothesis, its shape free to
differ as far as evidence allows. It moves no probability.
"""

from collections.abc import Mapping

import numpy as np
import scipy

from hdcal.data.case import Case
from hdcal.diagnosis.where import declared_directions
from hdcal.evidence.bursts import BURSTS, burst_odds, is_noisy, noise_beside
from hdcal.evidence.case_evidence import NONE, QUANTISATION, UNKNOWN, CaseEvidence
from hdcal.evidence.hypothesis_design import fitted_curve
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.prepare import with_relative_noise, with_rows
from hdcal.evidence.remainder_evidence import beside_effects
from hdcal.evidence.residual_test import Directions, residual_test
from hdcal.physics.effect import Effect

# Draws of pure noise for one hypothesis.
_DRAWS = 600
# A hypothesis with a smaller p-value leaves more than noise.
_LEAST = 0.01
# An effect that closes less of the gap leaves more than it closes.
_MOST = 0.5


def leaves_most(evidence: CaseEvidence, hypothesis: str, effect: str) -> bool:
    """Tell whether an effect would leave most of the gap to unknown structure.

    Noise of any size can take in what is none, so that nothing seems to be left beside
    the effect. And what is smaller than the rounding of readings is a part of that.

    Args:
        evidence: of the case.
        hypothesis: the likeliest, effects joined with +.
        effect: that leads.
    """
    names, closed = {*hypothesis.split("+")}, evidence.closed.get(effect)
    # Of two effects together neither has to close most.
    second = names - {effect, UNKNOWN, *evidence.on_noise}
    if closed is None or effect in evidence.on_noise or second:
        return False
    if QUANTISATION in names:
        curve = fitted_curve(evidence, effect)[None]
        curve = remove_base(evidence.prepared.rows, curve)
        if np.sqrt(np.mean(curve**2)) < evidence.rounding_step / np.sqrt(12.0):
            return True
    return float(np.median(closed)) < _MOST


def chance_of_so_few_runs(wild: np.ndarray) -> float:
    """Return how probable it is that wild readings stand together as they do.

    Each goes wrong by itself, so that any places among the readings are as probable:
    the law of the number of runs is that of Wald and Wolfowitz (1940), one-sided.

    Args:
        wild: which readings are, in their order, shape (n,).
    """
    if not wild.any():
        return 1.0
    runs = int(wild[0]) + int(np.sum(wild[1:] & ~wild[:-1]))
    # Of the gaps between other readings, and both ends, those that hold a run.
    gaps = int(np.sum(~wild)) + 1
    return float(scipy.stats.hypergeom.cdf(runs, len(wild), gaps, int(wild.sum())))


def leaves_more_than_noise(
    evidence: CaseEvidence,
    hypothesis: str,
    case: Case,
    library: Mapping[str, type[Effect]],
    correlation: float,
    rng: np.random.Generator,
) -> bool:
    """Tell whether something is left beside a hypothesis that holds nothing unknown.

    Args:
        evidence: of the case.
        hypothesis: effects joined with +.
        case: for its labels.
        library: effects by name.
        correlation: AR(1) coefficient of the noise.
        rng: of the draws of pure noise.
    """
    names = hypothesis.split("+")
    # Rounding in steps above the noise leaves a pattern that is no effect.
    if {NONE, UNKNOWN, QUANTISATION} & {*names}:
        return False
    mean = next((name for name in names if name not in evidence.noise), None)
    curve = fitted_curve(evidence, mean) if mean else None
    prepared = beside_effects(evidence, names)
    kept = np.ones(len(prepared.rows.reading), bool)
    for noise in {*names} & evidence.noise.keys():
        relative = noise_beside(evidence, library, noise, curve).relative_sd
        if burst_odds(evidence, names, relative, correlation)[0] > BURSTS:
            return True
        if library[noise].mixture:
            wild = is_noisy(relative)
            if chance_of_so_few_runs(wild) < _LEAST:
                return True
            # Wild readings say nothing of the mean, however far off they are.
            kept &= ~wild
        prepared = with_relative_noise(prepared, relative)
    _, directions = declared_directions(evidence, case)
    directions = Directions(*(column[kept] for column in vars(directions).values()))
    prepared = with_rows(prepared, kept)
    tested = residual_test(prepared, correlation, directions, rng, draws=_DRAWS)
    return tested.mean_p_value < _LEAST
