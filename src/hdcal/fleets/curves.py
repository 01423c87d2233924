"""The readings of a fleet as curves, and whose of them are shown."""

from typing import NamedTuple

import numpy as np

from hdcal.fleets.fleet import Fleet

# Gears called off that have a colour, and others beside them.
MOST_CALLED, MOST_ORDINARY = 6, 60
# Readings of a path; more of them show nothing more.
_MOST_READINGS = 4000


class ShownGears(NamedTuple):
    """Whose readings are shown, as places among all gears.

    Attributes:
        ordinary: from the softest to the stiffest, evenly chosen where there are many.
        called: off, the surest first.
    """

    ordinary: np.ndarray
    called: np.ndarray


def shown_gears(found: Fleet) -> ShownGears:
    """Return the gears whose readings are shown, of those whose rows are kept."""
    kept = np.unique(np.asarray(found.case.records.specimen))
    called = kept[found.called[kept]]
    others = kept[~found.called[kept]]
    others = others[np.argsort(np.median(found.stiffness[:, others], axis=0))]
    some = np.linspace(0, len(others) - 1, min(len(others), MOST_ORDINARY))
    surest = np.argsort(-found.off[called], kind="stable")[:MOST_CALLED]
    return ShownGears(others[some.round().astype(int)], called[surest])


def curve(found: Fleet, gears: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the readings of gears as one path, broken between mountings.

    Of very many readings every second is taken, or every third, and so on.

    Args:
        found: the fleet.
        gears: their places among all.

    Returns:
        Deformation [mm as read] and force [N], NaN where the path is broken.
    """
    records = found.case.records
    rows = np.flatnonzero(np.isin(np.asarray(records.specimen), gears))
    mounted = np.stack([np.asarray(records.specimen), np.asarray(records.run)])[:, rows]
    order = np.lexsort(mounted[::-1])[:: 1 + len(rows) // _MOST_READINGS]
    rows, mounted = rows[order], mounted[:, order]
    breaks = 1 + np.flatnonzero(np.any(np.diff(mounted, axis=1), axis=0))
    x, y = np.asarray(records.deformation)[rows], np.asarray(records.force)[rows]
    return np.insert(x, breaks, np.nan), np.insert(y, breaks, np.nan)
