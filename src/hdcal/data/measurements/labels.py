"""Labels of rows: the mounting of each, its lot, operator, rig and date."""

from collections.abc import Mapping
from typing import Any

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
    operator, are of another mounting. An empty cell is that of the row of the same gear
    above it, or else below it.

    Args:
        values: by quantity, of each row, shape (n,).
        gear: index of each row's, shape (n,).
    """
    stated = {name: np.asarray(values[name]) for name in TELLING if name in values}
    if not stated:
        return None
    if "date" in stated:
        stated["date"] = days_of(stated["date"])
    cells = pd.DataFrame(stated, dtype=object)
    cells = cells.mask(cells == NOT_STATED)
    cells = cells.groupby(gear).ffill().groupby(gear).bfill().fillna(NOT_STATED)
    several = cells.groupby(gear).nunique().gt(1).any()
    # Not what is the same for all mountings of each gear.
    telling = cells.columns[several]
    if telling.empty:
        return None
    table = cells[telling].assign(gear=gear)
    index = table.groupby([*table], sort=False).ngroup().to_numpy()
    each = table.drop_duplicates()
    labels = each[telling].agg(" ".join, axis=1)
    # No two mountings of a gear have the same label.
    count = labels.groupby([each["gear"], labels]).cumcount()
    names = [f"{n} ({k + 1})" if k else n for n, k in zip(labels, count, strict=True)]
    return np.array(names, object)[index]


def further_labels(
    frame: pd.DataFrame,
    gear: np.ndarray,
    gears: tuple[str, ...],
    run: np.ndarray,
    runs: tuple[str, ...],
) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Return lots of gears, operators, rigs and dates of runs, as `Case` has them.

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
    labels = frame[quantity].astype(str).to_numpy()
    each: Any = pd.DataFrame({"of": index, "label": labels}).drop_duplicates()
    each = each[each["label"] != NOT_STATED]
    if (several := each["of"].duplicated()).any():
        word = "specimen" if quantity == "lot" else "run"
        name = quoted(names[each["of"][several].min()])
        return (), f"{quantity}s are not used: {word} {name} has several"
    stated = dict(zip(each["of"], each["label"], strict=True))
    return tuple(stated.get(one, NOT_STATED) for one in range(len(names))), ""
