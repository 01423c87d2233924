"""Long records: fewer rows that say nearly as much."""

from dataclasses import replace

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.evidence.row_features import half_cycles, take_rows

# Rows up to which every one is kept: kernels and tolerances of 10⁴ rows take 1 GB.
MOST_ROWS = 10_000
_AVERAGED = ("deformation", "temperature", "time", "angle", "rate", "force")


def average_rows(case: Case, most: int) -> Case:
    """Average neighbouring rows of a half cycle until few enough are left.

    Args:
        case: with rows in the order they were taken.
        most: about as many rows may be left.
    """
    group = int(np.ceil(len(case.records.force) / most))
    if group == 1:
        return case
    records = _run_after_run(case)
    half = half_cycles(records)
    new = _place(half) % group == 0
    member = np.cumsum(new) - 1
    count = np.bincount(member)
    means = {
        name: np.bincount(member, np.asarray(getattr(records, name))) / count
        for name in _AVERAGED
    }
    known = np.bincount(member, np.asarray(records.force_sd) ** 2) / count
    short = take_rows(records, np.flatnonzero(new))
    short = replace(short, **means, force_sd=np.sqrt(known / count))
    return replace(case, records=short)


def thin_rows(case: Case, step: int, *, turns: bool = False) -> Case:
    """Keep one row of so many in each run, the first one among them.

    A thinned AR(1) series is AR(1) with its coefficient to the power of the step; means
    of neighbours are not. Without `turns` the rows that are left are evenly spaced.

    Args:
        case: with rows in the order they were taken.
        step: 1 leaves it as it is.
        turns: count rows from the turns on, and keep those at which the path turns.
    """
    if step == 1:
        return case
    records = _run_after_run(case)
    label = half_cycles(records) if turns else np.asarray(records.run)
    last = np.diff(label, append=label[-1] + 1) != 0
    kept = np.flatnonzero((_place(label) % step == 0) | (turns & last))
    return replace(case, records=take_rows(records, kept))


def _run_after_run(case: Case) -> Records:
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    return take_rows(case.records, order)


def _place(label: np.ndarray) -> np.ndarray:
    """Return how many rows before each one have its label, which adjoin."""
    rows = np.arange(len(label))
    begins = np.diff(label, prepend=label[0] - 1) != 0
    return rows - np.maximum.accumulate(np.where(begins, rows, 0))
