"""Models of the noise: equal in all rows, growing with the force, or with outliers."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import betaln, entr, expit
from scipy.stats import hypergeom

from hdcal.data.prior import Prior
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.parameter_grid import (
    SCALE_WEIGHTS,
    SCALES,
    is_zero_centred,
    prior_rms,
)
from hdcal.evidence.row_features import half_cycle_rows, half_cycles
from hdcal.inference.distributions import quantiles
from hdcal.screening.turning_points import MEDIAN_SIZE

GROWING, OUTLIERS = "heteroscedastic_noise", "outliers"
# Prior odds of each effect on the noise, whatever acts on the mean.
PRIOR_ODDS = 0.02
# AR(1) coefficients of the noise that are always integrated over.
_CORRELATIONS = (0.0, 0.2, 0.4, 0.6)
# Noise may be correlated over a fifth of a half cycle, at most by 0.98; larger
# coefficients are added where they reach this far at least.
_SPANS, _LARGEST, _WORTHWHILE = 5.0, 0.98, 0.75
# Noise sd of the load alone at the largest force over the noise sd without load.
_GROWTH = 2.0 ** np.arange(-0.5, 4.0)
# Steps of the EM fit of outliers, and quantiles of the ratio of their noise.
_STEPS, _RATIOS = 15, 3
# Significance level of the tests of where outliers lie, and the most rows at which
# places of a cycle are tried to begin.
_CHANCE, _STARTS = 0.01, 12


class NoiseModel(NamedTuple):
    """One model of the noise; the name is empty for equal noise.

    The weight of a row is one over its relative noise sd. `log_prior` has the log prior
    odds, and all that does not depend on the mean reading.
    """

    name: str
    weight: Float[np.ndarray, " n"]
    correlation: float
    log_prior: float


def equal_noise(problem: LinearProblem) -> list[NoiseModel]:
    """Return noise that is equal in all rows, a model for each correlation.

    Where half cycles have many rows two larger correlations are added, up to the one
    that lasts for a fifth of a half cycle.
    """
    correlations = [*_CORRELATIONS]
    longest = min(np.exp(-_SPANS / half_cycle_rows(problem.records)), _LARGEST)
    if longest >= _WORTHWHILE:
        middle = np.exp(-np.sqrt(np.log(_CORRELATIONS[-1]) * np.log(longest)))
        correlations += [middle, longest]
    log_prior = -float(np.log(len(correlations)))
    return [NoiseModel("", problem.weight, float(c), log_prior) for c in correlations]


def correlated_noise(
    problem: LinearProblem, error: Float[np.ndarray, " n"], known: Sequence[float]
) -> list[NoiseModel]:
    """Return equal noise with the correlation of errors [N], at most the largest known.

    The list is empty where that correlation lies within two sds of a known one. The
    prior is the mass of a normal around it: uniform over the correlation times the
    width of its likelihood.
    """
    follows = problem.before >= 0
    error = error * problem.weight
    last = error[problem.before[follows]]
    found = float(error[follows] @ last / max(last @ last, 1e-300))
    found = float(np.clip(found, 0.0, max(known)))
    sd = np.sqrt((1.0 - found**2) / max(np.count_nonzero(follows), 1))
    if np.min(np.abs(np.subtract(known, found))) < 2.0 * sd:
        return []
    log_mass = float(np.log(min(np.sqrt(2.0 * np.pi) * sd, 1.0)))
    return [NoiseModel("", problem.weight, found, log_mass)]


def growing_noise(problem: LinearProblem, correlation: float) -> list[NoiseModel]:
    """Return noise of variance sd² + (share · force)², on a grid of the share."""
    zero, records = float(problem.base.deformation_offset), problem.records
    load = np.abs(np.asarray(records.deformation) - zero)
    load = load * float(problem.base.stiffness)
    growth, mass = _growth(problem, load)
    relative = np.sqrt(1.0 + (growth[:, None] * load / load.max()) ** 2)
    log_prior = np.log(PRIOR_ODDS) + np.log(mass)
    # The geometric mean stays one, so that the reference noise sd keeps its meaning.
    mean = np.exp(np.mean(np.log(relative), axis=1, keepdims=True))
    return [
        NoiseModel(GROWING, weight, correlation, float(log))
        for weight, log in zip(problem.weight * mean / relative, log_prior, strict=True)
    ]


def _growth(
    problem: LinearProblem, load: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " g"], Float[np.ndarray, " g"]]:
    """Return growths of the noise sd, as `_GROWTH`, with their prior probabilities.

    With g the growth, s the share, L the largest load, m the mean square of the load
    over L, and σ the noise sd over all rows, s L = g σ / √(1 + g² m).
    """
    prior, largest = problem.priors[f"{GROWING}.share"], float(load.max())
    mean_square = np.mean((load / largest) ** 2)
    if is_zero_centred(prior):
        typical = np.sqrt(1.0 + _GROWTH**2 * mean_square)
        share = _GROWTH * problem.noise_sd / typical / largest
        # A mixture of half-normals, in cells a factor 2 wide.
        z = share[:, None] / (prior_rms(prior) * SCALES)
        density = np.sqrt(2.0 / np.pi) * (z * np.exp(-0.5 * z**2)) @ SCALE_WEIGHTS
        return _GROWTH, np.maximum(np.log(2.0) * density, 1e-300)
    share = quantiles(prior, len(_GROWTH))
    variance = (share * largest / problem.noise_sd) ** 2
    # Larger shares than noise in proportion to the load has are cut.
    rest = np.maximum(1.0 - variance * mean_square, 1e-12)
    growth = np.minimum(np.sqrt(variance / rest), _GROWTH[-1])
    return growth, np.full(len(growth), 1.0 / len(growth))


class _Fit(NamedTuple):
    """An EM fit of outliers; `wild` are errors of wild rows [N], else 0."""

    bound: float
    weight: Float[np.ndarray, " n"]
    log_factor: float
    wild: Float[np.ndarray, " n"]


def outliers(
    problem: LinearProblem,
    correlation: float,
    fitted: Callable[[np.ndarray], np.ndarray],
) -> list[NoiseModel]:
    """Return the outlier model as weights of rows, by a variational bound.

    The list is empty where wild rows are neighbours or recur: that is structure.
    With any probabilities that rows are wild the evidence of every hypothesis is a
    lower bound, tight where rows are clearly wild or not; these come from an EM fit.
    `fitted` maps weights of rows to the mean reading given some hypothesis.
    """
    ratios = quantiles(problem.priors[f"{OUTLIERS}.ratio"], _RATIOS)
    best = max(
        (_fit_outliers(problem, ratio, fitted) for ratio in ratios),
        key=lambda fit: fit.bound,
    )
    if _clustered(problem, best.wild):
        return []
    grid = sorted({0.0, correlation})
    log_prior = np.log(PRIOR_ODDS) + best.log_factor - np.log(len(ratios) * len(grid))
    weight = problem.weight * best.weight
    return [NoiseModel(OUTLIERS, weight, c, float(log_prior)) for c in grid]


def _fit_outliers(problem: LinearProblem, ratio: float, fitted) -> _Fit:
    a, b = _beta_numbers(problem.priors[f"{OUTLIERS}.fraction"])
    count, share = len(problem.y), a / (a + b)
    error = problem.weight * (problem.y - fitted(problem.weight))
    sd = float(np.median(np.abs(error))) / MEDIAN_SIZE + 1e-300
    wild, weight = np.zeros(count), np.ones(count)
    for _ in range(_STEPS):
        log_odds = np.log(share / (1.0 - share)) - np.log(ratio)
        wild = expit(log_odds + 0.5 * (error / sd) ** 2 * (1.0 - ratio**-2.0))
        weight = np.sqrt(1.0 - wild + wild / ratio**2)
        error = problem.weight * (problem.y - fitted(problem.weight * weight))
        sd = float(np.sqrt(np.mean((weight * error) ** 2))) + 1e-300
        share = (a + wild.sum()) / (a + b + count)
    many = wild.sum()
    bound = betaln(a + many, b + count - many) - betaln(a, b)
    bound += np.sum(entr(wild) + entr(1.0 - wild)) - many * np.log(ratio)
    log_factor = float(bound - np.sum(np.log(weight)))
    found = np.where(wild > 0.5, error, 0.0)
    return _Fit(float(bound - count * np.log(sd)), weight, log_factor, found)


def _beta_numbers(prior: Prior) -> tuple[float, float]:
    """Return a and b of the beta distribution with mean and variance of a prior."""
    if prior.family == "beta":
        a, b = map(float, prior.numbers)
        return a, b
    share = np.clip(quantiles(prior, 1000), 1e-6, 1.0 - 1e-6)
    mean, product = float(share.mean()), float(share.mean() * (1.0 - share.mean()))
    total = max(product / max(float(share.var()), 1e-6 * product) - 1.0, 0.1)
    return mean * total, (1.0 - mean) * total


def _clustered(problem: LinearProblem, wild: Float[np.ndarray, " n"]) -> bool:
    """Whether wild errors [N] are not at random rows, either in time or in a cycle.

    Rows that are not wild have an error of 0. The order of a cycle is that of the
    deformation upwards and then downwards. At random rows errors of one sign are rarely
    neighbours in either order, and rarely at few places of several cycles.
    """
    records, rows, side = problem.records, np.arange(len(wild)), np.sign(wild)
    age = rows - np.maximum.accumulate(np.where(_begins(side), rows, 0))
    # A disturbance may last for two readings.
    disturbed = np.where(age % 2 == 0, side, 0.0)
    count = int(np.count_nonzero(disturbed))
    if count < 2:
        return False
    cycle = np.lexsort([records.sense * records.deformation, -records.sense])
    # In time two readings of a disturbance are one of half as many rows.
    chances = [
        _few_runs(side, count, max(len(rows) // 2, count)),
        _few_runs(disturbed[cycle], count, len(rows)),
    ]
    half = half_cycles(records)
    first = np.unique(half, return_index=True)[1]
    cycles = max(np.unique(records.sense[first], return_counts=True)[1])
    if cycles > 1:
        chances.append(_at_few_places(disturbed[cycle], half[cycle], cycles))
    return bool(np.min(chances) < _CHANCE / len(chances))


def _begins(side: Float[np.ndarray, " n"]) -> Bool[np.ndarray, " n"]:
    """Whether each row has another sign than the one before."""
    return np.diff(side, prepend=0.0) != 0.0


def _few_runs(side: Float[np.ndarray, " n"], count: int, rows: int) -> float:
    """Return the probability that random rows have as few runs of one sign.

    That of runs of any sign is hypergeometric (Wald and Wolfowitz, Ann. Math. Stat. 11,
    1940); those of one sign are at least as many.
    """
    runs = np.count_nonzero(_begins(side) & (side != 0.0))
    return float(hypergeom.cdf(runs, rows, rows - count + 1, count))


def _at_few_places(
    disturbed: Float[np.ndarray, " n"], half: Int[np.ndarray, " n"], cycles: int
) -> float:
    """Return the probability that random rows are at as few places of a cycle.

    A place has as many rows as there are cycles, and begins at one of several rows. Of
    a half cycle one row counts at a place: a burst is at one place of one cycle.
    """
    marked, least = np.flatnonzero(disturbed), 1.0
    starts = np.unique(np.linspace(0, cycles - 1, _STARTS).astype(int))
    for start in starts:
        place = (start + marked) // cycles
        count = len(np.unique([place, half[marked]], axis=1).T)
        least = min(least, _few_places(len(np.unique(place)), count, cycles, len(half)))
    return len(starts) * least


def _few_places(most: int, count: int, size: int, rows: int) -> float:
    """Return the probability that random rows are at so many places of a size at most.

    The rows are drawn one after the other, the next one at a place that has one or not;
    exact where the size divides the number of rows.
    """
    chance = np.ones(1)
    for drawn in range(count):
        taken = np.minimum(size * np.arange(len(chance)), rows)
        again, new = chance * np.maximum(taken - drawn, 0), chance * (rows - taken)
        chance = (np.append(again, 0.0) + np.append(0.0, new)) / (rows - drawn)
    return float(chance[: most + 1].sum())
