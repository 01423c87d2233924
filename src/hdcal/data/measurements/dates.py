"""Dates of mountings, as rigs and people write them."""

import re
from collections.abc import Sequence

import numpy as np
import pandas as pd

from hdcal.data.tables.cells import NOT_STATED
from hdcal.errors import quoted

# Forms of days; behind points the month stands second, behind slashes anywhere.
_DAYS = ("ISO8601", "%Y/%m/%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y")
_TIMES = ("", " %H:%M", " %H:%M:%S", " %I:%M %p", " %I:%M:%S %p")
_CLOCK = re.compile(r"[T ]+\d{1,2}:\d{2}.*$")
_DIGIT = re.compile(r"\d")
_ZONE = re.compile(r"(?<=:\d{2})(\.\d+)?(Z|[+-]\d{2}:?\d{2})$")
# Before and after these nobody measured: a plain number is no date.
_EARLIEST, _LATEST = np.datetime64("1950-01-01"), np.datetime64("2100-01-01")
_NONE = np.datetime64("NaT", "s")
_REMEDY = "Write dates as in 2026-09-01, year first"


def dates_of(
    labels: Sequence[str] | np.ndarray, of: np.ndarray
) -> tuple[tuple[str, ...], str]:
    """Return the first date of each mounting in ISO 8601, and a note.

    A mounting that states none, or none that can be read, has an empty one. No dates
    are returned, and the note says so, where most cannot be read, or all in two ways.

    Args:
        labels: of each row, shape (n,).
        of: index of each row's mounting, shape (n,).
    """
    if not len(labels):
        return (), ""
    texts, place = np.unique(np.array(labels, object), return_inverse=True)
    stated = texts != NOT_STATED
    times, note = np.full(len(texts), _NONE), ""
    if stated.any():
        written = texts[stated]
        ways = _ways(written)
        if len(ways) != 1:
            how = "can be read in two ways" if ways else "cannot be read as one"
            return (), f"dates are not used: {quoted(written[0])} {how}. {_REMEDY}"
        times[stated] = ways[0]
        if (unread := np.isnat(ways[0])).any():
            odd = quoted(written[int(np.argmax(unread))])
            note = f"the date {odd} cannot be read beside the others. {_REMEDY}"
    first = np.full(int(np.max(of)) + 1, _NONE)
    np.fmin.at(first, of, times[place])
    if np.isnat(first).all():
        return (), note
    return tuple("" if np.isnat(one) else str(one) for one in first), note


def days_of(labels: np.ndarray) -> np.ndarray:
    """Return the day that each label states, whatever the time.

    Args:
        labels: dates, shape (n,).

    Returns:
        Days in ISO 8601, as written where that can be read in two ways, and
        `NOT_STATED` where they cannot be read, shape (n,).
    """
    stamps, place = np.unique(np.array(labels, object), return_inverse=True)
    # Few days have many times.
    written = np.array([_CLOCK.sub("", text) for text in stamps], object)
    texts, day = np.unique(written, return_inverse=True)
    days = np.full(len(texts), NOT_STATED, object)
    stated = np.flatnonzero(texts != NOT_STATED)
    ways = _ways(texts[stated]) if len(stated) else []
    if len(ways) > 1:
        days[stated] = texts[stated]
    elif ways:
        read = ~np.isnat(ways[0])
        days[stated[read]] = ways[0][read].astype("datetime64[D]").astype(str)
    return days[day][place]


def _ways(texts: np.ndarray) -> list[np.ndarray]:
    """Return texts as times, in each of the ways in which most of them can be read."""
    # The local time counts; and a text without a number, such as today, is no date.
    plain = pd.Series([_ZONE.sub("", t) if _DIGIT.search(t) else "" for t in texts])
    ways: list[np.ndarray] = []
    for day in _DAYS:
        times = pd.Series(pd.NaT, index=plain.index, dtype="datetime64[s]")
        for time in _TIMES if "%" in day else ("",):
            if not (rest := times.isna()).any():
                break
            read = pd.to_datetime(plain[rest], format=day + time, errors="coerce")
            times[rest] = read.astype("datetime64[s]")
        each = times.to_numpy().astype("datetime64[s]")
        each[~((each > _EARLIEST) & (each < _LATEST))] = _NONE
        ways.append(each)
    # The way that leaves the fewest unread, and all others that leave as few.
    least = min(int(np.isnat(times).sum()) for times in ways)
    best = [times for times in ways if np.isnat(times).sum() == least]
    if 2 * least >= len(texts):
        return []
    alike = [np.array_equal(best[0], each, equal_nan=True) for each in best]
    return best[:1] if all(alike) else best
