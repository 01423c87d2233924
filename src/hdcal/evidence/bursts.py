"""Noise in bursts is no noise: what outliers take of a structure counts as unknown.

Noise, whatever its size in each row, has a sign of its own in each. Where readings that
a hypothesis takes to be noisy agree with their neighbours, something that lasts moves
them: the odds of that are evidence for structure in their place.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import product

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
from hdcal.evidence.noise_evidence import NoiseEvidence, noise_evidence
from hdcal.evidence.prepare import with_relative_noise
from hdcal.physics.effect import Effect

# Readings with a noise this much larger than the middle one are noisy.
_NOISY = 1.2
# Log odds from which noise in bursts is none.
BURSTS = float(np.log(10.0))
# How seldom what looks like noise is a structure that lasts, before its signs are seen.
_SELDOM = float(np.log(0.02))
# Log odds to the likeliest hypothesis below which another is no rival of it.
_HOPELESS = -25.0


def with_bursts(
    evidence: CaseEvidence,
    library: Mapping[str, type[Effect]],
    log_prior: Mapping[str, float],
) -> CaseEvidence:
    """Return the evidence in which noise in bursts is unknown structure as well.

    Args:
        evidence: of each hypothesis, those with a remainder included.
        library: effects by name.
        log_prior: of each hypothesis.
    """
    table, closed = dict(evidence.table), dict(evidence.closed)
    correlation = evidence.likeliest_correlation
    curve_of = cache(partial(fitted_curve, evidence))
    rivals = {
        (effect, noise): noise_beside(
            evidence, library, noise, curve_of(effect) if effect else None
        )
        for effect, noise in _candidates(evidence, log_prior)
    }
    for (effect, noise), found in rivals.items():
        pair, key = _keys(effect, noise)
        curve = curve_of(effect) if effect else None
        names = [effect] if effect else []
        log_odds, off = burst_odds(evidence, names, found.relative_sd, correlation)
        # As seldom beforehand beside the noise in whose place it stands.
        seldom = _SELDOM + log_prior[pair] - log_prior[key]
        lasting = evidence.table[pair] + log_odds + seldom
        if curve is not None:
            share = _share(evidence, curve, off)
            closed[effect] = _mixed(closed[effect], table[key], share, lasting)
        table[key] = np.logaddexp(table[key], lasting)
    return replace(evidence, table=table, closed=closed)


def _candidates(
    evidence: CaseEvidence, log_prior: Mapping[str, float]
) -> Iterator[tuple[str, str]]:
    """Yield the effects, "" for none, and the noise that may come in bursts beside it.

    Those in whose place no bursts, however clear, would be a rival are passed over.
    """
    whole = {
        n: np.logaddexp.reduce(e) + log_prior[n] for n, e in evidence.table.items()
    }
    # At most half of the rows are noisier than the middle one.
    half = len(evidence.prepared.rows.reading) // 2
    least = max(whole.values()) + _HOPELESS - _SELDOM - log_sign_odds(half, half)
    beside = [name for name in evidence.closed if name not in evidence.on_noise]
    for effect, noise in product(["", *beside], evidence.noise):
        pair, key = _keys(effect, noise)
        if key in whole and pair in whole and whole[pair] >= least:
            yield effect, noise


def _keys(effect: str, noise: str) -> tuple[str, str]:
    """Return what a noise beside an effect is called, and what a remainder there is."""
    if not effect:
        return noise, UNKNOWN
    return pair_name(effect, noise), with_remainder(effect)


def _mixed(
    closed: np.ndarray, known: np.ndarray, share: float, lasting: np.ndarray
) -> np.ndarray:
    """Return draws of the share closed, so many of them beside bursts as is probable.

    Args:
        closed: draws beside what was known, shape (d,).
        known: log evidence of that, [correlation].
        share: closed beside the bursts.
        lasting: log evidence of those, [correlation].
    """
    both = np.logaddexp.reduce(known), np.logaddexp.reduce(lasting)
    count = round(len(closed) * float(np.exp(both[1] - np.logaddexp(*both))))
    return np.concatenate([np.full(count, share), closed[count:]])


def noise_beside(
    evidence: CaseEvidence,
    library: Mapping[str, type[Effect]],
    noise: str,
    beside: np.ndarray | None,
) -> NoiseEvidence:
    """Return the evidence of an effect on the noise.

    Beside a loop of friction, which leaves little, wild readings are farther off than
    on their own.

    Args:
        evidence: of the case.
        library: effects by name.
        noise: name of an effect on the noise.
        beside: what an effect adds beside which it stands [N], None for none.
    """
    if beside is None:
        return evidence.noise[noise]
    return noise_evidence(library[noise], evidence.prepared, beside)


def is_noisy(relative: np.ndarray) -> np.ndarray:
    """Tell which readings are noisier than the middle one, of their relative sds."""
    return relative > _NOISY * np.median(relative)


def burst_odds(
    evidence: CaseEvidence,
    names: Sequence[str],
    relative: np.ndarray,
    correlation: float,
) -> tuple[float, np.ndarray]:
    """Return the log odds that noisy readings came in bursts, against one by one.

    In a burst neighbours agree with a probability that is uniform from one half to one.

    Args:
        evidence: of the case.
        names: of the hypothesis' effects.
        relative: noise of each row over that of a usual one, shape (n,).
        correlation: AR(1) coefficient of the noise.

    Returns:
        The log odds, and what noisy readings beside another are off by [N], (n,); 0 at
        the others, those that are struck one by one among them.
    """
    prepared = evidence.prepared
    rows = with_relative_noise(prepared, relative).rows
    fit = fit_design(rows, design_of(evidence, names), prepared.noise_sd, correlation)
    left = rows.reading - fit.predict()
    # Serial correlation alone makes neighbours agree.
    error = whiten(rows, left, correlation)
    noisy, before = is_noisy(relative), rows.before
    both = noisy & (before >= 0) & noisy[before]
    same = int(np.sum(both & (error * error[before] > 0.0)))
    together = both.copy()
    together[before[both]] = True
    return log_sign_odds(same, int(np.sum(both))), np.where(together, left, 0.0)


def _share(evidence: CaseEvidence, curve: np.ndarray, off: np.ndarray) -> float:
    """Return the share of the visible gap that a curve closes beside the bursts."""
    bursts = np.mean(np.maximum(off**2 - evidence.prepared.noise_sd**2, 0.0))
    seen = remove_base(evidence.prepared.rows, curve[None])
    whole = bursts + np.mean(seen**2)
    return float(1.0 - np.sqrt(bursts / max(whole, 1e-300)))


def log_sign_odds(same: int, pairs: int) -> float:
    """Return the log odds of dependent against independent signs.

    Args:
        same: pairs of neighbours that agree.
        pairs: of neighbours in all.
    """
    other = pairs - same
    tail = max(float(betainc(other + 1, same + 1, 0.5)), 1e-300)
    whole = float(betaln(same + 1, other + 1)) + np.log(tail)
    return float(whole + (pairs + 1) * np.log(2.0))
