"""Noise in bursts is no noise: what outliers take of a structure counts as unknown.

Noise, whatever its size in each row, has a sign of its own in each. Where readings that
a hypothesis takes to be noisy agree with their neighbours, something that lasts moves
them: the odds of that are evidence for structure in their place.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import betainc, betaln

from hdcal.evidence.case_evidence import (
    UNKNOWN,
    CaseEvidence,
    pair_name,
    with_remainder,
)
from hdcal.evidence.design_matrix import fit_design
from hdcal.evidence.hypothesis_design import design_of, fitted_curve
from hdcal.evidence.linear_rows import remove_base, whiten
from hdcal.evidence.prepare import with_relative_noise

# Readings with a noise this much larger than the middle one are noisy.
_NOISY = 1.2
# Noise in bursts of higher odds than this is structure.
BURSTS = 10.0


def with_bursts(evidence: CaseEvidence) -> CaseEvidence:
    """Return the evidence in which noise in bursts is unknown structure as well.

    Args:
        evidence: of each hypothesis, those with a remainder included.
    """
    table, closed = dict(evidence.table), dict(evidence.closed)
    beside = [name for name in closed if name not in evidence.on_noise]
    for noise in evidence.noise:
        for effect in ("", *beside):
            names = [name for name in (effect, noise) if name]
            whole = table.get(pair_name(effect, noise) if effect else noise)
            odds, _ = burst_odds(evidence, names, evidence.likeliest_correlation)
            if whole is None or odds <= BURSTS:
                continue
            key = with_remainder(effect) if effect else UNKNOWN
            lasting = whole + np.log(odds)
            if effect and np.logaddexp.reduce(lasting - table[key]) > 0.0:
                share = _share(evidence, effect, noise)
                closed[effect] = np.full_like(closed[effect], share)
            # Either the one kind of structure or the other.
            table[key] = np.logaddexp(table[key], lasting) - np.log(2.0)
    return replace(evidence, table=table, closed=closed)


def burst_odds(
    evidence: CaseEvidence, names: Sequence[str], correlation: float
) -> tuple[float, np.ndarray]:
    """Return the odds that noisy readings came in bursts, against one by one.

    In a burst neighbours agree with a probability that is uniform from one half to one.

    Args:
        evidence: of the case.
        names: of the hypothesis' effects.
        correlation: AR(1) coefficient of the noise.

    Returns:
        The odds, and what the noisy readings are off by [N], 0 at the others.
    """
    prepared, odds = evidence.prepared, 1.0
    off = np.zeros(len(prepared.rows.reading))
    for name in names:
        if name not in evidence.noise:
            continue
        relative = evidence.noise[name].relative_sd
        rows = with_relative_noise(prepared, relative).rows
        design = design_of(evidence, names)
        fit = fit_design(rows, design, prepared.noise_sd, correlation)
        left = rows.reading - fit.predict()
        # Serial correlation alone makes neighbours agree.
        error = whiten(rows, left, correlation)
        noisy = relative > _NOISY * np.median(relative)
        before = rows.before
        both = noisy & (before >= 0) & noisy[before]
        same = int(np.sum(both & (error * error[before] > 0.0)))
        odds *= sign_odds(same, int(np.sum(both)))
        off = np.where(noisy, left, off)
    return odds, off


def _share(evidence: CaseEvidence, effect: str, noise: str) -> float:
    """Return the share of the visible gap that an effect closes beside the bursts."""
    correlation = evidence.likeliest_correlation
    _, off = burst_odds(evidence, [effect, noise], correlation)
    bursts = np.mean(np.maximum(off**2 - evidence.prepared.noise_sd**2, 0.0))
    curve = remove_base(evidence.prepared.rows, fitted_curve(evidence, effect)[None])
    whole = bursts + np.mean(curve**2)
    return float(1.0 - np.sqrt(bursts / max(whole, 1e-300)))


def sign_odds(same: int, pairs: int) -> float:
    """Return the odds of dependent against independent signs.

    Args:
        same: pairs of neighbours that agree.
        pairs: of neighbours in all.
    """
    other = pairs - same
    whole = betaln(same + 1, other + 1) + np.log(betainc(other + 1, same + 1, 0.5))
    return float(np.exp(whole + (pairs + 1) * np.log(2.0)))
