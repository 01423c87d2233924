"""Does the likeliest cause leave only noise? If not, something else is at work.

Evidence compares hypotheses with each other; all of them may be wrong. So the residual
test is repeated on the readings beside each likely hypothesis, its shape free to
differ as far as evidence allows. A small p-value moves probability to "unknown".
"""

from dataclasses import replace

import numpy as np
from scipy.special import betainc, betaln

from hdcal.data.case import Case
from hdcal.diagnosis.model_posterior import ModelPosterior, move_to_unknown
from hdcal.diagnosis.where import declared_directions
from hdcal.evidence.case_evidence import NONE, QUANTISATION, UNKNOWN, CaseEvidence
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.hypothesis_design import design_of
from hdcal.evidence.linear_rows import whiten
from hdcal.evidence.piecewise_effect import TOLERANCES
from hdcal.evidence.prepare import PreparedCase, with_relative_noise
from hdcal.evidence.residual_test import residual_test

# Hypotheses as likely as this are tested, with this many draws of pure noise.
_LIKELY, _DRAWS = 0.1, 600
# Odds, before the data, of something that resembles an effect but is none.
_RESEMBLES = 0.07
# The amplitude is as good as free: it may be this many times what was found.
_FREE = 3.0
# Readings with a noise this much larger than the middle one are noisy.
_NOISY = 1.2


def move_inadequate_to_unknown(
    evidence: CaseEvidence,
    posterior: ModelPosterior,
    case: Case,
    correlation: float,
    rng: np.random.Generator,
) -> ModelPosterior:
    """Move probability to unknown from hypotheses that leave more than noise.

    `correlation` is the AR(1) coefficient of the noise.

    Source:
        T. Sellke, M. J. Bayarri and J. O. Berger, The American Statistician 55 (2001):
        a p-value speaks for its hypothesis with odds of at least −e p ln p.
    """
    kept = {}
    for name, share in posterior.probabilities.items():
        names = name.split("+")
        # Rounding in steps above the noise leaves a pattern that is no effect.
        if share < _LIKELY or {NONE, UNKNOWN, QUANTISATION} & {*names}:
            continue
        p = _p_value(evidence, names, case, correlation, rng)
        odds = -np.e * p * np.log(p) if p < np.exp(-1.0) else 1.0
        odds /= max(1.0, _burst_odds(evidence, names, correlation))
        # Where there is no surprise nothing is moved.
        kept[name] = min(1.0, odds * (1.0 + _RESEMBLES) / (odds + _RESEMBLES))
    return move_to_unknown(posterior, kept)


def _p_value(
    evidence: CaseEvidence, names: list[str], case: Case, correlation: float, rng
) -> float:
    """Return the p-value of the mean beside a hypothesis at its best fit."""
    prepared = evidence.prepared
    for name in names:
        if name in evidence.noise:
            noise = evidence.noise[name].relative_sd
            prepared = with_relative_noise(prepared, noise)
    prepared = _beside(evidence, prepared, names, correlation)
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


def _beside(
    evidence: CaseEvidence, prepared: PreparedCase, names: list[str], correlation: float
) -> PreparedCase:
    """Return the case whose base model also holds what effects may add."""
    rows, design = prepared.rows, design_of(evidence, names)
    if not len(design.columns):
        return prepared
    fit = fit_design(rows, design, prepared.noise_sd, correlation)
    width = rows.base.shape[1]
    added = fit.contribution(width)
    size = np.abs(fit.mean[width : width + len(design.columns)])
    free = _FREE * size[:, None] * design.columns
    loose = TOLERANCES[-1] * added * rows.tolerance
    columns = np.concatenate([rows.base, free.T, loose.T], axis=1)
    precision = np.full(columns.shape[1], prepared.noise_sd**2)
    precision[:width] = rows.precision
    rest = replace(
        rows, reading=rows.reading - design.offset, base=columns, precision=precision
    )
    return replace(prepared, rows=rest)
