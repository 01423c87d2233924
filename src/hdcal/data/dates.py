"""Dates of mountings, as rigs and people write them."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from hdcal.data.cells import NOT_STATED
from hdcal.errors import quoted

# How days are written; behind points the month stands second, behind slashes anywhere.
_DAYS = ("ISO8601", "%Y/%m/%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y")
_TIMES = ("", " %H:%M", " %H:%M:%S")
# Before and after these nobody measured: a plain number is no date.
_EARLIEST, _LATEST = np.datetime64("1950-01-01"), np.datetime64("2100-01-01")
_REMEDY = "Write 2026-09-01"


def dates_of(
    labels: Sequence[str] | np.ndarray, of: np.ndarray
) -> tuple[tuple[str, ...], str]:
    """Return the first date of each mounting, as ISO 8601 has it, and a note.

    A mounting that states none has an empty one. Nothing is returned where dates cannot
    be read, which the note says.

    Args:
        labels: of each row.
        of: index of each row's mounting, shape (n,).
    """
    if not len(labels):
        return (), ""
    place, texts = pd.factorize(np.array(labels, object))
    told = np.array([text != NOT_STATED for text in texts])
    times = np.full(len(texts), np.datetime64("NaT", "s"))
    if told.any():
        readings = _readings([text for text in texts if text != NOT_STATED])
        if len(readings) != 1:
            odd = quoted(next(text for text in texts if text != NOT_STATED))
            how = "can be read in two ways" if readings else "is none that can be read"
            return (), f"dates are not used: {odd} {how}. {_REMEDY}"
        times[told] = readings[0]
    first = np.full(int(np.max(of)) + 1, np.datetime64("NaT", "s"))
    np.fmin.at(first, of, times[place])
    if np.isnat(first).all():
        return (), ""
    return tuple("" if np.isnat(one) else str(one) for one in first), ""


def _readings(texts: Sequence[str]) -> list[np.ndarray]:
    """Return in how many ways all texts can be read, each as times."""
    found: list[np.ndarray] = []
    for day in _DAYS:
        for time in _TIMES if "%" in day else ("",):
            read = pd.to_datetime(
                pd.Series(texts), format=day + time, errors="coerce", utc=True
            )
            times = read.dt.tz_localize(None).to_numpy().astype("datetime64[s]")
            within = (times > _EARLIEST) & (times < _LATEST)
            if within.all() and not any(np.array_equal(times, one) for one in found):
                found.append(times)
    return found
