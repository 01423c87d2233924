"""Whether what is said with 70 % is true seven times in ten.

Stated probabilities fall into at most ten bins of equal counts (at least twenty in
each; equal values stay together). In a bin with n_b of n statements, mean statement
m_b and share true h_b, the plug-in error is the sum of n_b/n |h_b - m_b|. Scatter
alone makes that positive, so that it is debiased as by Kumar, Liang and Ma (Verified
uncertainty calibration, 2019): twice the plug-in less what it would be with the
scatter once more, where the scatter is that of a calibrated diagnoser,
sum p (1 - p) / n_b². `floor` is what a perfectly calibrated diagnoser who states the
same would show by the same estimator: mean and 95 % point of simulations.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import ndtr

from hdcal.blind.scoring.estimates import BOOTSTRAP, SEED, Estimate, OfEffect, share
from hdcal.blind.scoring.scored_case import Cases

ESTIMATOR = (
    "Expected calibration error over at most ten bins of equal counts (twenty "
    "statements each or more), debiased as by Kumar, Liang and Ma (2019) with the "
    "scatter of a calibrated diagnoser; interval: bootstrap over cases, its spread put "
    "about the value; floor: what a perfectly calibrated diagnoser would show who "
    "states the same about as many cases."
)
_LEAST_STATED = 0.05
_MOST_BINS, _LEAST_IN_BIN, _REPEATS = 10, 20, 500


@dataclass(frozen=True)
class Statements:
    """Probabilities that were stated, and whether what they were stated of is true.

    Attributes:
        case: index of the case, shape (n,).
        stated: probability, shape (n,).
        true: 0 or 1, shape (n,).
    """

    case: np.ndarray
    stated: np.ndarray
    true: np.ndarray


def top_statements(cases: Cases) -> Statements:
    """Return what is said of the most probable hypothesis."""
    rows = [
        (index, case.probabilities.get(case.top, 0.0), case.top == case.truth)
        for index, case in enumerate(cases)
        if case.truth is not None and case.probabilities
    ]
    return _statements(rows)


def effect_statements(
    cases: Cases, effect: str | None = None, least: float = 0.0
) -> Statements:
    """Return what is said of each effect, alone or beside another.

    Args:
        cases: real data is left out.
        effect: a single one; None for all.
        least: smaller statements are left out.
    """
    rows = [
        (index, chance, name in case.label.truth)
        for index, case in enumerate(cases)
        if case.truth is not None
        for name, chance in case.answer.inclusion.items()
        if chance >= least and effect in (None, name)
    ]
    return _statements(rows)


def _statements(rows: list) -> Statements:
    table = np.array(rows, dtype=float).reshape(-1, 3)
    return Statements(table[:, 0].astype(int), np.clip(table[:, 1], 0, 1), table[:, 2])


def bin_of(stated: np.ndarray) -> np.ndarray:
    """Return the bin of each statement."""
    count = int(np.clip(len(stated) // _LEAST_IN_BIN, 1, _MOST_BINS))
    if not len(stated):
        return np.zeros(0, dtype=int)
    inner = np.quantile(stated, np.arange(1, count) / count)
    return np.unique(np.searchsorted(inner, stated), return_inverse=True)[1]


def errors(
    places: np.ndarray, stated: np.ndarray, true: np.ndarray, weight: np.ndarray
) -> tuple[float, float]:
    """Return the calibration error, plug-in and debiased.

    Args:
        places: bin of each statement.
        stated: probabilities.
        true: 0 or 1.
        weight: how often each counts.
    """

    def total(values: np.ndarray) -> np.ndarray:
        return np.bincount(places, weight * values)

    count = total(np.ones_like(stated))
    filled = np.maximum(count, 1e-12)
    gap = np.abs(total(true - stated)) / filled
    sd = np.sqrt(total(stated * (1.0 - stated))) / filled
    # Mean of |gap + sd Z|, Z standard normal.
    ratio = gap / np.maximum(sd, 1e-12)
    again = sd * np.sqrt(2 / np.pi) * np.exp(-0.5 * ratio**2) + gap * (
        1.0 - 2.0 * ndtr(-ratio)
    )
    part = count / max(count.sum(), 1e-12)
    plug_in = float(part @ gap)
    return plug_in, max(0.0, 2.0 * plug_in - float(part @ again))


@dataclass(frozen=True)
class Bin:
    """Statements of about the same probability, and the share that was true."""

    from_: float
    to: float
    stated: float
    true: float | None
    lo: float | None
    hi: float | None
    n: int


@dataclass(frozen=True)
class Floor:
    """What a perfectly calibrated diagnoser would show: mean and 95 % point."""

    mean: float
    hi: float


@dataclass(frozen=True)
class Reliability(Estimate):
    """The debiased calibration error of statements, and what it comes from."""

    plug_in: float | None
    floor: Floor | None
    statements: int
    bins: list[Bin]


@dataclass(frozen=True)
class EffectError(Estimate, OfEffect):
    """The debiased calibration error of all statements of one effect."""


@dataclass(frozen=True)
class Reliabilities:
    """Of the most probable hypothesis, effects given 5 % or more, each effect alone."""

    top: Reliability
    effects: Reliability
    classwise: list[EffectError]


def reliabilities(cases: Cases) -> Reliabilities:
    """Return whether statements hold as often as stated."""
    names = sorted({name for case in cases for name in case.answer.inclusion})
    return Reliabilities(
        reliability(top_statements(cases)),
        reliability(effect_statements(cases, least=_LEAST_STATED)),
        [
            EffectError(
                effect=name, **vars(calibration_error(effect_statements(cases, name)))
            )
            for name in names
        ],
    )


def reliability(found: Statements) -> Reliability:
    """Return the calibration error of statements, and the table it comes from."""
    n, error = len(found.stated), vars(calibration_error(found))
    if not n:
        return Reliability(**error, plug_in=None, floor=None, statements=0, bins=[])
    places = bin_of(found.stated)
    return Reliability(
        **error,
        plug_in=errors(places, found.stated, found.true, np.ones(n))[0],
        floor=_floor(places, found),
        statements=n,
        bins=[_bin(found, places == place) for place in range(places.max() + 1)],
    )


def calibration_error(found: Statements) -> Estimate:
    """Return the debiased calibration error of statements."""
    places, n = bin_of(found.stated), len(found.stated)
    cases = len(np.unique(found.case))
    if not n:
        return Estimate(None, None, None, 0, BOOTSTRAP)
    _, value = errors(places, found.stated, found.true, np.ones(n))
    low, high = _spread(places, found, value) if cases > 1 else (None, None)
    return Estimate(value, low, high, cases, BOOTSTRAP)


def _spread(places, found: Statements, value: float) -> tuple[float, float]:
    index = np.unique(found.case, return_inverse=True)[1]
    repeats = []
    for count in _resamplings(int(index.max()) + 1):
        weight = count[index].astype(float)
        repeats.append(errors(places, found.stated, found.true, weight)[1])
    # Resampling scatters twice, which lifts an error; only its spread is used.
    low, high = np.quantile(repeats, [0.025, 0.975]) - np.mean(repeats)
    return float(np.clip(value + low, 0.0, value)), float(value + max(high, 0.0))


@lru_cache(maxsize=1)
def _resamplings(n: int) -> np.ndarray:
    """Return how often each of n cases is drawn, shape (repeats, n).

    Kept for the next effect: each of them is stated in every case.
    """
    rng = np.random.default_rng(SEED)
    return rng.multinomial(n, np.full(n, 1.0 / n), size=_REPEATS).astype(np.int32)


def _floor(places: np.ndarray, found: Statements) -> Floor:
    rng = np.random.default_rng(SEED + 1)
    one = np.ones(len(found.stated))
    repeats = [
        errors(places, found.stated, rng.random(len(one)) < found.stated, one)[1]
        for _ in range(_REPEATS)
    ]
    return Floor(float(np.mean(repeats)), float(np.quantile(repeats, 0.95)))


def _bin(found: Statements, own: np.ndarray) -> Bin:
    true, stated = share(found.true[own]), found.stated[own]
    ends = float(stated.min()), float(stated.max())
    return Bin(*ends, float(stated.mean()), true.value, true.lo, true.hi, true.n)
