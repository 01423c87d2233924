"""Labels of rows: the mounting of each, its lot, operator, rig and date."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.tables.cells import NOT_STATED
from hdcal.errors import quoted

TELLING = ("date", "rig", "operator")  # what is the same all through a mounting
# The day of a time stamp in any form; a date in ISO 8601, alone or with a time.
_DAY = r"^(\d+[-./]\d+[-./]\d+)"
_ISO = r"^\d{4}-\d\d-\d\d(?:[T ]|$)"


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
    above it, or else below it. Values by quantity and index of the gear, shape (n,).
    """
    stated = {name: np.asarray(values[name]) for name in TELLING if name in values}
    if not stated:
        return None
    cells = pd.DataFrame(stated, dtype=object)
    cells = cells.mask(cells == NOT_STATED)
    if "date" in cells:
        cells["date"] = cells["date"].str.extract(_DAY)[0]
    cells = cells.groupby(gear).ffill().groupby(gear).bfill().fillna(NOT_STATED)
    several = cells.groupby(gear).nunique().gt(1).any()
    # Not what is the same for all mountings of each gear.
    telling = cells.columns[several]
    if telling.empty:
        return None
    first, *others = (cells[name] for name in telling)
    return first.str.cat(others, sep=" ").to_numpy(object)


def further_labels(
    frame: pd.DataFrame,
    gear: np.ndarray,
    gears: tuple[str, ...],
    run: np.ndarray,
    runs: tuple[str, ...],
) -> tuple[dict[str, tuple[str, ...]], list[str]]:
    """Return lots, operators, rigs and dates for `Case`, and notes on unused ones."""
    each = {
        "lots": _one_each(frame, "lot", gear, gears),
        "operators": _one_each(frame, "operator", run, runs),
        "rigs": _one_each(frame, "rig", run, runs),
        "dates": _dates(frame, run),
    }
    labels = {name: texts for name, (texts, _) in each.items()}
    return labels, [note for _, note in each.values() if note]


def _one_each(
    frame: pd.DataFrame, quantity: str, index: np.ndarray, names: tuple[str, ...]
) -> tuple[tuple[str, ...], str]:
    """Return the label of each gear or run; none and a note where one has several.

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
        why = f"{word} {name} has several values"
        return (), f"the column {quantity} is not used: {why}"
    stated = dict(zip(each["of"], each["label"], strict=True))
    return tuple(stated.get(i, NOT_STATED) for i in range(len(names))), ""


def _dates(frame: pd.DataFrame, run: np.ndarray) -> tuple[tuple[str, ...], str]:
    """Return the first date of each run, or none and a note where one is unreadable."""
    texts: Any = pd.Series(
        frame["date"].astype(str).to_numpy() if "date" in frame else []
    )
    stated = texts[texts != NOT_STATED]
    if stated.empty:
        return (), ""
    # The local time counts, whatever its zone.
    local = stated.str.replace(r"(Z|[+-]\d\d:?\d\d)$", "", regex=True)
    local = local.where(stated.str.contains(r"[T ]"), stated)
    times = pd.to_datetime(local, format="ISO8601", errors="coerce")
    wrong = times.isna() | ~stated.str.contains(_ISO)
    if wrong.any():
        words = f"dates are not used: {quoted(stated[wrong].iloc[0])} is not a date"
        return (), f"{words}. Write dates as year-month-day, such as 2026-09-01"
    first = times.reindex(texts.index).groupby(run).min()
    return tuple("" if pd.isna(one) else one.isoformat() for one in first), ""
