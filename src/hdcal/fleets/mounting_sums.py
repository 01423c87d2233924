"""From readings to what each mounting says: seven sums, whatever the number of rows."""

from collections.abc import Sequence

import numpy as np

from hdcal.data.case import Case
from hdcal.evidence.prepare import moments
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


def lot_grouping(sums: MountingSums, lot: np.ndarray) -> Grouping:
    """Return where lots seem to be, as shares of the stiffness.

    Args:
        sums: of every mounting.
        lot: index of each gear's lot, shape (g,).
    """
    slope = _slopes(sums)
    return _estimated(slope / np.median(slope), lot)


def operator_grouping(sums: MountingSums) -> Grouping:
    """Return where the zeros of operators seem to be [N]."""
    zero = np.asarray(sums.y) - _slopes(sums)[sums.gear] * np.asarray(sums.x)
    return _estimated(zero, np.asarray(sums.operator))


def _slopes(sums: MountingSums) -> np.ndarray:
    """Return the stiffness of each gear by its own line [N/mm as read]."""
    return np.bincount(sums.gear, sums.xy) / np.bincount(sums.gear, sums.xx)


def _estimated(values: np.ndarray, group: np.ndarray) -> Grouping:
    """Return groups by their medians, so that a gear that is off moves none."""
    middle = np.array([np.median(values[group == k]) for k in range(group.max() + 1)])
    sd = middle_sd(values - middle[group])
    least = 1e-6 * np.max(np.abs(values))
    return grouping(middle, max(sd, least) ** 2 / np.bincount(group))


def mountings(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return gear and run of each mounting, shape (2, m), and the mounting of rows."""
    labels = np.stack([np.asarray(case.records.specimen), np.asarray(case.records.run)])
    pairs, of_row = np.unique(labels, axis=1, return_inverse=True)
    return pairs, of_row.ravel()


def mounting_sums(case: Case, ratio: np.ndarray) -> MountingSums:
    """Return the sums of a case, one entry for each gear in each mounting.

    Args:
        case: the readings.
        ratio: stiffness of each gear's sizes over that of the gear file's, by which
            deformations count, so that all gears are of one size; shape (g,).
    """
    records, gear = case.records, case.gear
    pairs, of_row = mountings(case)
    warm = np.asarray(records.temperature) - gear.reference_temperature
    loss, _ = moments(gear.priors["alpha"])
    x = np.asarray(records.deformation) * (1.0 - loss * warm)
    x = x * ratio[np.asarray(records.specimen)]
    y = np.asarray(records.force)
    rows = np.bincount(of_row).astype(float)
    mean_x, mean_y = (np.bincount(of_row, v) / rows for v in (x, y))
    about_x, about_y = x - mean_x[of_row], y - mean_y[of_row]
    products = (about_x**2, about_x * about_y, about_y**2)
    xx, xy, yy = (np.bincount(of_row, product) for product in products)
    operator = groups(case.operators)[1]
    by = operator[pairs[1]] if len(operator) else np.zeros(len(rows), int)
    return MountingSums(pairs[0], rows, mean_x, mean_y, xx, xy, yy, by)
