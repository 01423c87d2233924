"""Which mounting each row was taken on, where no column `run` says so."""

from collections.abc import Mapping
from itertools import compress

import numpy as np

from hdcal.data.dates import days_of
from hdcal.data.tables.cells import NOT_STATED

# What is the same all through a mounting.
TELLING = ("date", "rig", "operator")


def run_labels(values: Mapping[str, np.ndarray], gear: np.ndarray) -> np.ndarray | None:
    """Return the label of each row's run; None where nothing tells runs apart.

    Without a column `run`, rows of a gear on another day or rig, or by another
    operator, are of another mounting.

    Args:
        values: by quantity, of each row, shape (n,).
        gear: index of each row's, shape (n,).
    """
    if "run" in values:
        return values["run"]
    told = {name: values[name] for name in TELLING if name in values}
    if not told:
        return None
    if "date" in told:
        told["date"] = days_of(told["date"])
    import pandas as pd

    table = pd.DataFrame({"gear": gear} | told)
    index = table.groupby([*table], sort=False).ngroup()
    mountings: dict[int, tuple[list, list]] = {}
    gears, each = [], []
    for one, *cells in table.drop_duplicates().itertuples(index=False):
        gears.append(one)
        each.append(_mounting(*mountings.setdefault(one, ([], [])), cells))
    known = [whole for whole, _ in mountings.values()]
    # Not what was the same for all mountings of each gear.
    telling = [
        any(len({cells[at] for cells in of} - {NOT_STATED}) > 1 for of in known)
        for at in range(len(told))
    ]
    if not any(telling):
        return None
    labels = [" ".join(compress(cells, telling)) for cells in each]
    return np.array(_told_apart(gears, each, labels), object)[index]


def _told_apart(gears: list, each: list[list[str]], labels: list[str]) -> list[str]:
    """Return labels of which no two mountings of a gear have the same."""
    whose: dict[tuple, list[str]] = {}
    found = []
    for gear, cells, label in zip(gears, each, labels, strict=True):
        own, count = label, 1
        while whose.setdefault((gear, own), cells) is not cells:
            count += 1
            own = f"{label} ({count})"
        found.append(own)
    return found


def _mounting(known: list, loose: list, cells: list[str]) -> list[str]:
    """Return the mounting of a gear that cells tell; a new one is added to the known.

    An empty cell tells none: of those that the others fit it is the latest.

    Args:
        known: mountings of the gear.
        loose: those of them that began with an empty cell.
        cells: unlike all before.
    """
    empty = NOT_STATED in cells
    # Without an empty cell on either side nothing fits.
    for mounting in reversed(known if empty else loose):
        pairs = [*zip(mounting, cells, strict=True)]
        if all(one == other or NOT_STATED in (one, other) for one, other in pairs):
            mounting[:] = [b if a == NOT_STATED else a for a, b in pairs]
            return mounting
    known.append(cells)
    if empty:
        loose.append(cells)
    return cells
