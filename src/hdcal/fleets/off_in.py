"""What gears are off in: stiffness, noise, zero or shape, with few false calls."""

from collections.abc import Mapping

import numpy as np
import scipy
from scipy.special import digamma, polygamma, stdtr

from hdcal.fleets.gear_sums import MountingSums
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.population_problem import PopulationProblem

# Share of the gears that are called off which are ordinary ones at most, in the mean.
FALSE_CALLS = 0.05
# Of it, what each may take. Held against those inside on both sides, zeros and shapes
# are called twice as often as their chances say (tests/fleets/test_off_in.py).
_LEVELS = {"stiffness": 0.035, "noise": 0.005, "zero": 0.0025, "shape": 0.0025}
# Others that a gear is held against, at least; of all gears, the chance below which one
# is off whatever the others are.
_FEWEST, _CLEARLY = 3, 0.001


def called_off(chances: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return which gears are called off in what: so far out that few are ordinary.

    In the mean at most `FALSE_CALLS` of those called are ordinary gears; where none is
    off, in as many fleets any is called.

    Args:
        chances: of each gear, that an ordinary one is as far out in it, shape (g,).

    Source:
        Benjamini and Hochberg, Journal of the Royal Statistical Society B 57 (1995).
    """
    return {
        name: scipy.stats.false_discovery_control(chance) <= _LEVELS[name]
        for name, chance in chances.items()
    }


def noise_chance(problem: PopulationProblem, ratio: np.ndarray) -> np.ndarray:
    """Return the chance that an ordinary gear scatters as much, shape (g,).

    The log of the variance that ν degrees of freedom leave has a mean and a variance
    of its own.

    Args:
        problem: the gears.
        ratio: of their noise beside what is no line's to that beside lines.
    """
    free = np.asarray(problem.sums.noise_free)
    told = np.flatnonzero(free > 0.0)
    half = 0.5 * free[told]
    log_sd = (np.asarray(problem.sums.log_noise_sd) + np.log(ratio))[told]
    log_sd = log_sd - 0.5 * (digamma(half) - np.log(half))
    found = np.ones(len(free))
    found[told] = chance_of(log_sd, log_sd, 0.25 * polygamma(1, half))
    return found


def zero_chance(
    sums: MountingSums,
    draws: Mapping[str, np.ndarray],
    stiffness: np.ndarray,
    noise_sd: np.ndarray,
) -> np.ndarray:
    """Return the chance that an ordinary gear's zeros are as far off, shape (g,).

    It is the mean over the gear's mountings, beside what their operators have.

    Args:
        sums: of each mounting, as if one rig had read them all.
        draws: of the population by site, shape (t,).
        stiffness: of each gear, shape (t, g) [N/mm].
        noise_sd: of each gear, shape (g,) [N].
    """
    gear, x, y, rows = map(np.asarray, (sums.gear, sums.x, sums.y, sums.rows))
    many = np.bincount(gear)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(gear, values) / many

    by = np.mean(np.asarray(group_offsets(draws, "operator")), axis=1)
    zero = mean(y - np.median(stiffness, axis=0)[gear] * x - by[sums.operator])
    of_line = many * (np.std(stiffness, axis=0) * mean(x)) ** 2
    of_line += mean(noise_sd[gear] ** 2 / rows)
    # As far as one mounting is: the mean of many lies nearer to all others.
    apart = np.sqrt(many) * (zero - np.median(zero))
    return chance_of(apart, np.abs(apart), of_line)


def chance_of(
    values: np.ndarray, extremes: np.ndarray, variances: np.ndarray
) -> np.ndarray:
    """Return the chance of each gear to lie as far from the others, shape (g,).

    These are those that are less far out, so that gears that are off hide neither
    themselves nor each other. Of the least far out nothing is told.

    Args:
        values: of each gear, nearly normal, shape (g,).
        extremes: how far out it is, likewise.
        variances: of its own error, which is in what scatters; likewise.

    Source:
        Rosner, Technometrics 25 (1983), from the inside outwards.
    """
    order = np.argsort(extremes, kind="stable")
    own = values[order] - np.median(values)
    errors = variances[order]
    total, squares, error = (
        np.cumsum(v)[_FEWEST - 1 : -1] for v in (own, own**2, errors)
    )
    many = np.arange(_FEWEST, len(own))
    order, own, errors = order[_FEWEST:], own[_FEWEST:], errors[_FEWEST:]
    scatter = (squares - total**2 / many) / (many - 1.0)
    # What those inside scatter by beside their own errors.
    spread = np.maximum(scatter - error / many, 0.0)

    def chance(inside: np.ndarray) -> np.ndarray:
        sd = np.sqrt(errors + (spread + scatter / many)[inside])
        far = np.abs(own - (total / many)[inside]) / sd
        return 2.0 * stdtr(many[inside] - 1.0, -far)

    inside = np.arange(len(own))
    # Beyond the first that is clearly off none is an ordinary one to be held against.
    off = chance(inside) < _CLEARLY / len(values)
    first = int(np.argmax(off)) if off.any() else len(own)
    found = np.ones(len(values))
    found[order] = chance(np.minimum(inside, first))
    return found
