"""What is known of each gear, given draws of the population."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hdcal.fleets.gear_sums import MountingSums
from hdcal.fleets.off_in import noise_chance, zero_chance
from hdcal.fleets.population_problem import (
    PopulationProblem,
    draw_gears,
    gear_centres,
)

# Draws of the population for which every gear is drawn too: more for few gears, as many
# as make a million.
_GEAR_DRAWS, _IN_ALL = 400, 1_000_000
# Draws of gears at most, whatever their number: they are held in memory.
_MOST_DRAWN = 20_000_000


def each_gear(
    problem: PopulationProblem,
    sums: MountingSums,
    draws: Mapping[str, np.ndarray],
    seed: int,
    ratio: np.ndarray,
) -> dict[str, Any]:
    """Return what is known of each gear, as `Fleet` has it.

    Args:
        problem: the gears.
        sums: of each mounting, as if one rig had read them all.
        draws: of the population by site, shape (d,).
        seed: of the draws.
        ratio: of the noise of each gear beside its own shapes to that beside lines.
    """
    gears = len(problem.sums.lot)
    many = min(max(_GEAR_DRAWS, _IN_ALL // gears), _MOST_DRAWN // gears)
    every = -(-len(draws["stiffness"]) // many)
    chosen = {name: v[::every] for name, v in draws.items()}
    drawn = draw_gears(problem, chosen, seed)
    stiffness, off = np.asarray(drawn.stiffness), np.asarray(drawn.off)
    centre = np.asarray(gear_centres(chosen, problem.sums.lot)).T
    apart = stiffness / centre - 1.0
    zeros = sums.y - np.median(stiffness, axis=0)[sums.gear] * sums.x
    noise_sd = np.median(np.asarray(drawn.noise_sd), axis=0)
    # About a centre and a scatter that the gear itself has no part in: where it is off.
    apart_by_chance = np.sum(off * np.asarray(drawn.chance), axis=0) / off.sum(axis=0)
    return {
        "stiffness": stiffness,
        "apart": apart,
        "noise_sd": ratio * noise_sd,
        "own_noise_sd": ratio * _own_noise(problem, noise_sd),
        "zero": np.bincount(sums.gear, zeros) / np.bincount(sums.gear),
        "distance": np.median(apart / chosen["specimen_sd"][:, None], axis=0),
        "off": off.mean(axis=0),
        "chances": {
            "stiffness": apart_by_chance,
            "noise": noise_chance(problem, ratio),
            "zero": zero_chance(sums, chosen, stiffness, noise_sd),
        },
    }


def _own_noise(problem: PopulationProblem, noise_sd: np.ndarray) -> np.ndarray:
    """Return what each gear's own line leaves [N], or what the law of all says.

    A gear whose noise is off is no draw of the law of all, which pulls it in.
    """
    free, log_sd = problem.sums.noise_free, problem.sums.log_noise_sd
    return np.where(np.asarray(free) > 0.0, np.exp(log_sd), noise_sd)
