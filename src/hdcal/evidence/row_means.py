"""Long records: means of neighbouring rows say nearly as much as the rows."""

from dataclasses import replace

import numpy as np

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.evidence.row_features import half_cycles, take_rows

# Rows up to which every one is kept: kernels and tolerances of 10⁴ rows take 1 GB.
MOST_ROWS = 10_000
_AVERAGED = ("deformation", "temperature", "time", "angle", "rate", "force")


def average_rows(case: Case, most: int = MOST_ROWS) -> tuple[Case, int]:
    """Average neighbouring rows of a half cycle until few enough are left.

    Args:
        case: with rows in the order they were taken.
        most: about as many rows may be left.

    Returns:
        The case, and how many rows went into each mean; 1 leaves it as it is.
    """
    size = len(case.records.force)
    group = int(np.ceil(size / most))
    if group == 1:
        return case, 1
    order = np.argsort(np.asarray(case.records.run), kind="stable")
    records = take_rows(case.records, order)
    return replace(case, records=_means(records, group)), group


def _means(records: Records, group: int) -> Records:
    half = half_cycles(records)
    starts = np.flatnonzero(np.diff(half, prepend=half[0] - 1) != 0)
    place = np.arange(len(half)) - starts[half - half[0]]
    new = (place % group == 0) | (np.diff(half, prepend=half[0] - 1) != 0)
    member = np.cumsum(new) - 1
    count = np.bincount(member)
    first = np.flatnonzero(new)
    short = take_rows(records, first)
    means = {
        name: np.bincount(member, np.asarray(getattr(records, name))) / count
        for name in _AVERAGED
    }
    known = np.bincount(member, np.asarray(records.force_sd) ** 2) / count
    return replace(short, **means, force_sd=np.sqrt(known / count))
