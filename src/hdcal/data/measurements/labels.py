"""Labels of rows: the mounting of each, its lot, operator, rig and date."""

from collections.abc import Mapping
from itertools import compress

import numpy as np
import pandas as pd

from hdcal.data.measurements.dates import dates_of, days_of
from hdcal.data.tables.cells import NOT_STATED
from hdcal.errors import quoted

# What is the same all through a mounting.
TELLING = ("date", "rig", "operator")


def mountings(frame: pd.DataFrame) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return the index of each row's mounting, shape (n,), and the names of mountings.

    The same label of a run on two gears is two mountings, and so are the rows before
    and after a jump of a zero.
    """
    keys = ["specimen", "run", "zero"]
    index = frame.groupby(keys, sort=False, observed=True).ngroup().to_numpy()
    each = [*frame.drop_duplicates(keys)[keys].itertuples(index=False)]
    alone = len({gear for gear, *_ in each}) == 1
    pairs = {(gear, run) for gear, run, _ in each}
    unique = len({run for _, run in pairs}) == len(pairs)
    names = []
    for gear, run, zero in each:
        if not run:
            run = "1" if alone else gear
        elif not unique:
            run = f"{gear}/{run}"
        names.append(f"{run} (zero {zero + 1})" if zero else run)
    return index, tuple(names)


def run_labels(values: Mapping[str, np.ndarray], gear: np.ndarray) -> np.ndarray | None:
    """Return the label of each row's run; None where nothing tells runs apart.

    Without a column `run`, rows of a gear on another day or rig, or by another
    operator, are of another mounting.

    Args:
        values: by quantity, of each row, shape (n,).
        gear: index of each row's, shape (n,).
    """
    stated = {name: np.asarray(values[name]) for name in TELLING if name in values}
    if not stated:
        return None
    if "date" in stated:
        stated["date"] = days_of(stated["date"])
    table = pd.DataFrame({"gear": gear} | stated)
    index = table.groupby([*table], sort=False).ngroup()
    of_gears: dict[int, tuple[list, list]] = {}
    pairs = []
    for one, *cells in table.drop_duplicates().itertuples(index=False):
        pairs.append((one, _mounting(*of_gears.setdefault(one, ([], [])), cells)))
    known = [whole for whole, _ in of_gears.values()]
    # Not what was the same for all mountings of each gear.
    telling = [
        any(len({cells[at] for cells in of} - {NOT_STATED}) > 1 for of in known)
        for at in range(len(stated))
    ]
    if not any(telling):
        return None
    # No two mountings of a gear have the same label.
    taken: dict[tuple, list[str]] = {}
    labels = []
    for one, cells in pairs:
        label = name = " ".join(compress(cells, telling))
        count = 1
        while taken.setdefault((one, label), cells) is not cells:
            count += 1
            label = f"{name} ({count})"
        labels.append(label)
    return np.array(labels, object)[index]


def _mounting(known: list, loose: list, cells: list[str]) -> list[str]:
    """Return the mounting of a gear that cells state; a new one is added to the known.

    An empty cell states none: of those that the others fit it is the latest. Loose are
    the known mountings that began with an empty cell.
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


def further_labels(
    frame: pd.DataFrame,
    gear: np.ndarray,
    gears: tuple[str, ...],
    run: np.ndarray,
    runs: tuple[str, ...],
) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Return lots of gears, operators, rigs and dates of runs, as `Case` has them.

    Args:
        frame: of the rows.
        gear: index of each row's, shape (n,).
        gears: their names.
        run: index of each row's, shape (n,).
        runs: their names.

    Returns:
        The labels, and notes on those that are not used.
    """
    days = frame["date"].to_numpy() if "date" in frame else ()
    each = {
        "lots": _one_each(frame, "lot", gear, gears),
        "operators": _one_each(frame, "operator", run, runs),
        "rigs": _one_each(frame, "rig", run, runs),
        "dates": dates_of(days, run),
    }
    labels = {name: one for name, (one, _) in each.items()}
    return labels, [note for _, note in each.values() if note]


def _one_each(
    frame: pd.DataFrame, quantity: str, index: np.ndarray, names: tuple[str, ...]
) -> tuple[tuple[str, ...], str]:
    """Return the one label of each gear or run, and a note.

    There are none where the file states none, or one has several, which the note says.
    An empty cell is filled by the others of its gear or mounting.
    """
    if quantity not in frame:
        return (), ""
    stated: dict[int, set[str]] = {}
    labels = frame[quantity].astype(str).to_numpy()
    for one, label in dict.fromkeys(zip(index.tolist(), labels, strict=True)):
        stated.setdefault(one, set()).add(label)
    for one, several in stated.items():
        several.discard(NOT_STATED)
        if len(several) > 1:
            word = "specimen" if quantity == "lot" else "run"
            name = quoted(names[one])
            return (), f"{quantity}s are not used: {word} {name} has several"
    return tuple(next(iter(stated[one]), NOT_STATED) for one in sorted(stated)), ""
