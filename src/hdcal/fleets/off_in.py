"""What gears are off in: stiffness, noise or zero, each with few false calls."""

from collections.abc import Mapping

import numpy as np
from scipy.special import digamma, polygamma
from scipy.stats import false_discovery_control, norm

from hdcal.inference.gear_sums import MountingSums
from hdcal.inference.groupings import group_offsets
from hdcal.inference.population_problem import PopulationProblem

# Share of the gears called off in something which are ordinary in it at most, in the
# mean. Of all together it is their sum: stiffness is what is asked.
FALSE_CALLS_IN = {"stiffness": 0.04, "noise": 0.005, "zero": 0.005}
FALSE_CALLS = sum(FALSE_CALLS_IN.values())


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
        name: false_discovery_control(chance) <= FALSE_CALLS_IN[name]
        for name, chance in chances.items()
    }


def noise_chance(
    problem: PopulationProblem, draws: Mapping[str, np.ndarray]
) -> np.ndarray:
    """Return the chance that an ordinary gear scatters as much, shape (g,).

    The log of a gear's noise is normal over gears, and that of a variance of ν degrees
    of freedom about it nearly so, with the mean and the variance that it has.

    Args:
        problem: the gears.
        draws: of the population by site, shape (t,).
    """
    free = problem.sums.noise_free
    told = np.asarray(free) > 0.0
    half = 0.5 * np.where(told, free, 1.0)
    centre = 0.5 * (digamma(half) - np.log(half))
    variance = 0.25 * polygamma(1, half)
    found = np.zeros(len(half))
    for sigma, spread in zip(draws["sigma"], draws["noise_spread"], strict=True):
        apart = np.asarray(problem.sums.log_noise_sd) - np.log(sigma) - centre
        found += norm.sf(apart / np.sqrt(spread**2 + variance))
    return np.where(told, found / len(draws["sigma"]), 1.0)


def zero_chance(
    sums: MountingSums,
    draws: Mapping[str, np.ndarray],
    stiffness: np.ndarray,
    noise_sd: np.ndarray,
) -> np.ndarray:
    """Return the chance that an ordinary gear's zeros are as far off, shape (g,).

    It is the mean over the gear's mountings, beside what their operators have.

    Args:
        sums: of each mounting.
        draws: of the population by site, shape (t,).
        stiffness: of each gear, of as many draws, shape (t, g) [N/mm].
        noise_sd: of each gear, shape (g,) [N].
    """
    gear, x, y, rows = map(np.asarray, (sums.gear, sums.x, sums.y, sums.rows))
    many = np.bincount(gear)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(gear, values) / many

    zero = mean(y - np.median(stiffness, axis=0)[gear] * x)
    of_line = (np.std(stiffness, axis=0) * mean(x)) ** 2
    of_line += mean(noise_sd[gear] ** 2 / rows) / many
    by = np.atleast_2d(np.asarray(group_offsets(draws, "operator")).T)
    found = np.zeros(len(many))
    for place, (centre, sd) in enumerate(
        zip(draws["zero"], draws["run_offset_sd"], strict=True)
    ):
        own = mean(by[place % len(by)][np.asarray(sums.operator)])
        apart = np.abs(zero - centre - own) / np.sqrt(sd**2 / many + of_line)
        found += 2.0 * norm.sf(apart)
    return found / len(draws["zero"])
