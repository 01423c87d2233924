"""Lots, operators and rigs: which are told apart, and where they seem to be."""

from collections.abc import Sequence

import numpy as np
import scipy

from hdcal.data.case import Case
from hdcal.fleets.change_points import middle_sd
from hdcal.fleets.gear_sums import MountingSums
from hdcal.fleets.groupings import Grouping, grouping

# Lots, operators or rigs, each of which has a number of its own.
MOST_GROUPS = 40
# Share of a size below which nothing seems to scatter.
_NOTHING = 1e-6


def groups(labels: Sequence[str]) -> tuple[list[str], np.ndarray]:
    """Return the lots of gears, or who or what read runs, and the index of each.

    Nothing of a single one, which cannot be told from all, of very many, and of as many
    as there are gears or runs.
    """
    names, index = np.unique(np.array(labels, str), return_inverse=True)
    told = 1 < len(names) <= min(MOST_GROUPS, len(labels) - 1)
    return (names.tolist(), index) if told else ([], np.zeros(0, int))


def group_of(labels: Sequence[str], runs: np.ndarray) -> np.ndarray:
    """Return the index of each run's group; noughts where none are told apart.

    Args:
        labels: of each run.
        runs: index of the runs that are asked about.
    """
    index = groups(labels)[1]
    return index[runs] if len(index) else np.zeros(len(runs), int)


def read_by(case: Case, runs: np.ndarray) -> dict[str, np.ndarray]:
    """Return who mounted runs and which rig read them, as `MountingSums` has it.

    Args:
        case: whose operators and rigs are told.
        runs: index of the runs that are asked about.
    """
    told = {"operator": case.operators, "rig": case.rigs}
    return {kind: group_of(labels, runs) for kind, labels in told.items()}


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


def rig_grouping(sums: MountingSums, noise_sd: float) -> Grouping:
    """Return where the gains of rigs seem to be, as shares of the stiffness.

    By least squares: a gear that several rigs read compares these as well as its lines
    are known, one of a single rig as well as gears are alike, and the less the farther
    it is off.

    Args:
        sums: of every mounting.
        noise_sd: of readings, about [N].
    """
    rigs = 1 + int(np.max(sums.rig))
    pairs, pair = np.unique(sums.gear * rigs + sums.rig, return_inverse=True)
    gear, rig = np.divmod(pairs, rigs)
    xx = np.maximum(np.bincount(pair, sums.xx), np.finfo(float).tiny)
    slope = np.bincount(pair, sums.xy) / xx
    value = slope / np.median(slope) - 1.0
    weight = xx * (np.median(slope) / noise_sd) ** 2
    apart = value - _medians(value, rig)[rig]
    own_sd = np.full(1 + int(gear.max()), middle_sd(apart))
    np.maximum.at(own_sd, gear, np.abs(apart))
    seen = np.zeros((len(own_sd), rigs))
    seen[gear, rig] = weight
    # What rigs share of a gear is its own stiffness, which is integrated out.
    shared = seen.T / (1.0 / np.maximum(own_sd, _NOTHING) ** 2 + seen.sum(axis=1))
    pull = np.bincount(rig, weight * value)
    pull -= shared @ np.bincount(gear, weight * value)
    # A gain that nothing tells is known to some hundred percent.
    covariance = np.linalg.inv(np.diag(1.0 + seen.sum(axis=0)) - shared @ seen)
    return grouping(covariance @ pull, covariance)


def linked_rigs(sums: MountingSums) -> np.ndarray:
    """Return of each rig which others gears link it to: equal numbers, shape (k,)."""
    gears, rigs = (1 + int(np.max(index)) for index in (sums.gear, sums.rig))
    read, ends = np.ones(len(sums.gear)), (sums.gear, gears + sums.rig)
    links = scipy.sparse.coo_array((read, ends), shape=(gears + rigs, gears + rigs))
    return scipy.sparse.csgraph.connected_components(links, directed=False)[1][gears:]


def slopes(sums: MountingSums) -> np.ndarray:
    """Return the stiffness of each gear by its own line [N/mm as read]."""
    return np.bincount(sums.gear, sums.xy) / np.bincount(sums.gear, sums.xx)


def zeros(sums: MountingSums) -> np.ndarray:
    """Return the zero of each mounting beside its gear's own line [N]."""
    return np.asarray(sums.y) - slopes(sums)[sums.gear] * np.asarray(sums.x)


def _estimated(values: np.ndarray, group: np.ndarray) -> Grouping:
    """Return groups by their medians, so that a gear that is off moves none."""
    middle = _medians(values, group)
    sd = middle_sd(values - middle[group])
    least = _NOTHING * np.max(np.abs(values))
    return grouping(middle, np.diag(max(sd, least) ** 2 / np.bincount(group)))


def _medians(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Return the median of each group, shape (k,)."""
    return np.array([np.median(values[group == k]) for k in range(group.max() + 1)])
