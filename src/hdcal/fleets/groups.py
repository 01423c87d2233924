"""Lots and operators: which are told apart, and where they seem to be."""

from collections.abc import Sequence

import numpy as np

from hdcal.fleets.change_points import middle_sd
from hdcal.inference.gear_sums import MountingSums
from hdcal.inference.groupings import Grouping, grouping

# Lots, or operators, each of which has a number of its own.
MOST_GROUPS = 40


def groups(labels: Sequence[str]) -> tuple[list[str], np.ndarray]:
    """Return the lots of gears, or the operators of runs, and the index of each.

    Nothing of a single one, which cannot be told from all, of very many, and of as many
    as there are gears or runs.
    """
    names, index = np.unique(np.array(labels, str), return_inverse=True)
    told = 1 < len(names) <= min(MOST_GROUPS, len(labels) - 1)
    return (names.tolist(), index) if told else ([], np.zeros(0, int))


def operator_of(operators: Sequence[str], runs: np.ndarray) -> np.ndarray:
    """Return the index of who mounted each run; noughts where none are told apart.

    Args:
        operators: of each run.
        runs: index of the runs that are asked about.
    """
    index = groups(operators)[1]
    return index[runs] if len(index) else np.zeros(len(runs), int)


def lot_grouping(sums: MountingSums, lot: np.ndarray) -> Grouping:
    """Return where lots seem to be, as shares of the stiffness.

    Args:
        sums: of every mounting.
        lot: index of each gear's lot, shape (g,).
    """
    slope = slopes(sums)
    return _estimated(slope / np.median(slope), lot)


def operator_grouping(sums: MountingSums) -> Grouping:
    """Return where the zeros of operators seem to be [N]."""
    return _estimated(zeros(sums), np.asarray(sums.operator))


def slopes(sums: MountingSums) -> np.ndarray:
    """Return the stiffness of each gear by its own line [N/mm as read]."""
    return np.bincount(sums.gear, sums.xy) / np.bincount(sums.gear, sums.xx)


def zeros(sums: MountingSums) -> np.ndarray:
    """Return the zero of each mounting beside its gear's own line [N]."""
    return np.asarray(sums.y) - slopes(sums)[sums.gear] * np.asarray(sums.x)


def _estimated(values: np.ndarray, group: np.ndarray) -> Grouping:
    """Return groups by their medians, so that a gear that is off moves none."""
    middle = np.array([np.median(values[group == k]) for k in range(group.max() + 1)])
    sd = middle_sd(values - middle[group])
    least = 1e-6 * np.max(np.abs(values))
    return grouping(middle, max(sd, least) ** 2 / np.bincount(group))
