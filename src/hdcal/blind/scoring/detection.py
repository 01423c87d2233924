"""From which size on a gap is detected, by effect."""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from hdcal.blind.scoring.estimates import Estimate, OfEffect, share
from hdcal.blind.scoring.scored_case import Cases, ScoredCase

METHOD = (
    "Fraction detected = 5 % + 95 % logistic(s (log r - m)), 5 % being the test's own "
    "level. Posterior on a grid, flat in m and log s: unlike a fitted maximum it stays "
    "finite where detected and undetected sizes do not overlap. r90: where the "
    "fraction is 90 %; median and 95 % interval, null beyond the sizes that were tried."
)
ALARM = 0.05
_WANTED = 0.9


@dataclass(frozen=True)
class _Size:
    r: float


@dataclass(frozen=True)
class DetectedShare(Estimate, _Size):
    """The fraction detected of gaps of one size r."""


@dataclass(frozen=True)
class FittedFraction:
    """The fitted fraction detected over r, with its 95 % band."""

    r: list[float]
    fraction: list[float]
    lo: list[float]
    hi: list[float]


@dataclass(frozen=True)
class DetectionCurve(OfEffect):
    """From which size on an effect is detected.

    Attributes:
        n: number of cases.
        points: fraction detected by size.
        r90: size of which 90 % are detected; None above all that were tried.
        lo: lower end of its interval.
        hi: upper end.
        reached: whether it is within what was tried, or below.
        below_all: whether it is below all that were tried.
        curve: the fit.
    """

    n: int
    points: list[DetectedShare]
    r90: float | None
    lo: float | None
    hi: float | None
    reached: bool
    below_all: bool
    curve: FittedFraction


def detection(cases: Cases) -> list[DetectionCurve]:
    """Return the detection curve of every effect, of those in the library and not."""
    own: dict[str, list[ScoredCase]] = {}
    for case in cases:
        if case.one_effect and case.label.r > 0.0:
            own.setdefault(case.label.truth[0], []).append(case)
    return [
        fit(
            name,
            np.array([case.label.r for case in own[name]]),
            np.array([case.answer.detected for case in own[name]], dtype=float),
        )
        for name in sorted(own)
    ]


def _points(r: np.ndarray, hit: np.ndarray) -> list[DetectedShare]:
    """Return the fraction detected by size, sizes within a factor of √2 together."""
    places = np.round(2.0 * np.log2(r))
    found = []
    for place in np.unique(places):
        own = places == place
        fraction = share(hit[own])
        middle = float(np.exp(np.mean(np.log(r[own]))))
        found.append(DetectedShare(r=middle, **vars(fraction)))
    return found


def fit(effect: str, r: np.ndarray, hit: np.ndarray) -> DetectionCurve:
    """Return the fitted curve and r90.

    Args:
        effect: whose gaps they were.
        r: sizes, all positive.
        hit: whether each was detected.
    """
    low, high = float(np.log(r.min())), float(np.log(r.max()))
    middle = np.linspace(low - 2.0, high + 2.0, 121)[:, None]
    slope = np.geomspace(0.5, 20.0, 25)[None, :]
    log_chance = np.zeros((middle.size, slope.size))
    for size, seen in zip(np.log(r), hit, strict=True):
        chance = _fraction(size, middle, slope)
        log_chance += np.log(chance if seen else 1.0 - chance)
    weight = np.exp(log_chance - log_chance.max()).ravel()
    edge = np.log((_WANTED - ALARM) / (1.0 - _WANTED))
    limits = (middle + edge / slope).ravel()
    grid = np.linspace(low, high, 25)
    curves = np.array([_fraction(x, middle, slope).ravel() for x in grid])
    band = np.array([_quantiles(c, weight, (0.025, 0.975)) for c in curves])
    r90, lo, hi = _quantiles(limits, weight, (0.5, 0.025, 0.975))
    fraction = curves @ weight / weight.sum()
    return DetectionCurve(
        effect,
        len(r),
        _points(r, hit),
        *(_within(end, low, high) for end in (r90, lo, hi)),
        reached=bool(r90 <= high),
        below_all=bool(r90 < low),
        curve=FittedFraction(
            np.exp(grid).tolist(), fraction.tolist(), *band.T.tolist()
        ),
    )


def _fraction(log_r: float, middle: np.ndarray, slope: np.ndarray) -> np.ndarray:
    # Kept off 1, where rounding would make a single miss impossible.
    found = ALARM + (1.0 - ALARM) * expit(slope * (log_r - middle))
    return np.minimum(found, 1.0 - 1e-9)


def _quantiles(values: np.ndarray, weight: np.ndarray, shares) -> list[float]:
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return [float(values[order][np.searchsorted(total, q * total[-1])]) for q in shares]


def _within(log_r: float, low: float, high: float) -> float | None:
    """Return a size, None above all that were tried; below all, the smallest."""
    return None if log_r > high else float(np.exp(max(log_r, low)))
