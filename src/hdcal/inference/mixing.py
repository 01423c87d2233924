"""How well chains mixed: R-hat and effective draws of many quantities at once.

Source: Vehtari, Gelman, Simpson, Carpenter and Bürkner, Rank-normalization, folding,
and localization, Bayesian Analysis 16, 667 (2021).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.special

# What chains that have mixed show at most, and at least.
MAX_RHAT, ESS_PER_CHAIN = 1.01, 100
# Quantiles for which effective draws of the tails count: those of ArviZ, so that who
# asks it for them gets the same.
_TAILS = 1.0 - 0.89, 0.89
# Blom's, of the normal scores of ranks.
_OFFSET = 3.0 / 8.0
_FEWEST = 4


@dataclass(frozen=True)
class Mixing:
    """How well the chains mixed in one quantity.

    Attributes:
        rhat: rank-normalised split R-hat.
        ess_bulk: effective draws for the centre.
        ess_tail: effective draws for the interval's ends.
    """

    rhat: float
    ess_bulk: float
    ess_tail: float


def mixing(draws: Mapping[str, np.ndarray]) -> dict[str, Mixing]:
    """Return how well the chains mixed in each quantity, (chain, draw) each.

    A quantity that stands still has an R-hat of NaN, one with NaN among its draws has
    nothing else; so has all where there are fewer than four draws.
    """
    if not draws:
        return {}
    whole = np.stack([np.asarray(values, float) for values in draws.values()])
    _, chains, many = whole.shape
    told = np.full((len(whole), 3), np.nan)
    valid = ~np.isnan(whole).any(axis=(1, 2))
    if many >= _FEWEST and valid.any():
        told[valid] = np.transpose(_told(whole[valid]))
    if chains < 2:
        told[:, 0] = np.nan
    return {
        name: Mixing(*map(float, row)) for name, row in zip(draws, told, strict=True)
    }


def have_mixed(draws: Mapping[str, np.ndarray]) -> bool:
    """Tell whether chains mixed in every quantity, (chain, draw) each."""
    # A NaN, of draws that stand still, is neither.
    return all(
        one.rhat <= MAX_RHAT
        and min(one.ess_bulk, one.ess_tail) >= ESS_PER_CHAIN * len(draws[name])
        for name, one in mixing(draws).items()
    )


def _told(whole: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return R-hat, bulk and tail ESS, shape (k,), of (k, chain, draw)."""
    halves = _halves(whole)
    middle = np.median(halves, axis=(1, 2), keepdims=True)
    scores = _scores(halves)
    rhat = np.maximum(_rhat(scores), _rhat(_scores(np.abs(halves - middle))))
    ends = np.quantile(whole, _TAILS, axis=(1, 2), keepdims=True)
    low, high = (_ess((halves <= end).astype(float)) for end in ends)
    return rhat, _ess(scores), np.minimum(low, high)


def _halves(whole: np.ndarray) -> np.ndarray:
    """Return chains split in two: they disagree with themselves where they drift."""
    half = whole.shape[-1] // 2
    return np.concatenate([whole[..., :half], whole[..., -half:]], axis=1)


def _scores(whole: np.ndarray) -> np.ndarray:
    """Return normal scores of the ranks of each quantity's draws, ties shared."""
    ranks = np.empty((len(whole), whole[0].size))
    for row, values in zip(ranks, whole, strict=True):
        _, place, many = np.unique(values, return_inverse=True, return_counts=True)
        row[:] = (np.cumsum(many) - 0.5 * (many - 1))[place.ravel()]
    share = (ranks - _OFFSET) / (ranks.shape[1] - 2.0 * _OFFSET + 1.0)
    return scipy.special.ndtri(share).reshape(whole.shape)


def _rhat(whole: np.ndarray) -> np.ndarray:
    many = whole.shape[-1]
    between = many * np.var(whole.mean(axis=2), axis=1, ddof=1)
    within = np.var(whole, axis=2, ddof=1).mean(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.sqrt((between / within + many - 1) / many)


def _ess(whole: np.ndarray) -> np.ndarray:
    """Return effective draws, shape (k,), of (k, chain, draw)."""
    _, chains, many = whole.shape
    covariance = _autocovariance(whole).mean(axis=1)
    variance = covariance[:, 0] + np.var(whole.mean(axis=2), axis=1, ddof=chains > 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        within = covariance[:, :1] * many / (many - 1.0)
        correlation = 1.0 - (within - covariance) / variance[:, None]
    correlation[:, 0] = 1.0
    size = chains * many
    still = np.ptp(whole, axis=(1, 2)) < np.finfo(float).resolution
    return np.array(
        [
            size if stands else size / max(_time(rho), 1.0 / np.log10(size))
            for rho, stands in zip(correlation, still, strict=True)
        ]
    )


def _autocovariance(whole: np.ndarray) -> np.ndarray:
    many = whole.shape[-1]
    length = 1 << (2 * many - 1).bit_length()
    waves = np.fft.rfft(whole - whole.mean(axis=-1, keepdims=True), length)
    return np.fft.irfft(np.abs(waves) ** 2, length)[..., :many] / many


def _time(correlation: np.ndarray) -> float:
    """Return the integrated autocorrelation time: Geyer's initial monotone sequence."""
    # Pairs of lags; the last ones of all say nothing.
    last = (len(correlation) - 3) // 2
    pairs = correlation[: 2 * last + 2].reshape(-1, 2).sum(axis=1)
    ended = np.flatnonzero(pairs <= 0.0)
    stop = int(ended[0]) if len(ended) else last
    kept = np.minimum.accumulate(pairs[:stop])
    return float(-1.0 + 2.0 * kept.sum() + max(correlation[2 * stop], 0.0))
