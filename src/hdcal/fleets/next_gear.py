"""Gears that were not measured: the next one, and what many of them will be."""

from collections.abc import Mapping

import numpy as np
from scipy.optimize.elementwise import find_root
from scipy.special import ndtr, ndtri

# Of bounds on many gears.
CONFIDENCE = 0.95


def next_gear(draws: Mapping[str, np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Return the stiffness of one more gear, for each draw [N/mm as read].

    It is of a lot that was not measured.
    """
    size = len(draws["stiffness"])
    off = rng.random(size) < draws["off_share"]
    wide = np.sqrt(1.0 + off * draws["off_ratio"] ** 2)
    lots = new_group_sd(draws, "lot")
    spread = np.hypot(draws["specimen_sd"] * wide, lots)
    apart = spread * rng.standard_normal(size)
    return draws["stiffness"] * (1.0 + apart)


def new_group_sd(draws: Mapping[str, np.ndarray], kind: str) -> np.ndarray:
    """Return how far a new lot, operator or rig lies from the mean of those told.

    Their mean lies as far from that of all as one of them, over the root of their
    number. Zero where none are told.

    Args:
        draws: of the population by site, shape (d,).
        kind: lot, operator or rig.
    """
    if f"{kind}_sd" not in draws:
        return np.zeros(1)
    measured = sum(name.startswith(f"{kind}_") for name in draws) - 1
    measured -= f"{kind}_ratio" in draws
    return draws[f"{kind}_sd"] * np.sqrt(1.0 + 1.0 / measured)


def stiffness_bounds(
    draws: Mapping[str, np.ndarray], content: float
) -> tuple[float, float]:
    """Return what a share of gears to come is stiffer than, and softer than [N/mm].

    Each bound holds by itself, with a confidence of `CONFIDENCE`: of so many draws of
    the population it leaves at least the share on its side.

    Args:
        draws: of the population by site, shape (d,).
        content: the share, above a half.
    """
    share, ratio = draws["off_share"], draws["off_ratio"]
    own, lots = draws["specimen_sd"], new_group_sd(draws, "lot")
    ordinary = np.hypot(own, lots)
    far = np.hypot(own * np.sqrt(1.0 + ratio**2), lots)
    wide = far / ordinary
    high = quantile_of_mixture(content, share, wide)
    reach = ordinary * high
    ends = draws["stiffness"] * (1.0 - reach), draws["stiffness"] * (1.0 + reach)
    return (
        max(float(np.quantile(ends[0], 1.0 - CONFIDENCE)), 0.0),
        float(np.quantile(ends[1], CONFIDENCE)),
    )


def quantile_of_mixture(
    content: float, share: np.ndarray, wide: np.ndarray
) -> np.ndarray:
    """Return how far a share of all members reaches, in sds of ordinary ones.

    Args:
        content: the share, above a half.
        share: of members that are off.
        wide: their sd in that of ordinary ones.
    """

    def excess(reach, share, wide):
        return (1.0 - share) * ndtr(reach) + share * ndtr(reach / wide) - content

    ends = np.zeros_like(share), ndtri(content) * wide
    return find_root(excess, ends, args=(share, wide)).x
