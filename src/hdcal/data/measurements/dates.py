"""Dates of mountings, as rigs and people write them."""

import re
from collections.abc import Sequence

import numpy as np

from hdcal.data.tables.cells import NOT_STATED
from hdcal.errors import quoted

# How days are written; behind points the month stands second, behind slashes anywhere.
_DAYS = ("ISO8601", "%Y/%m/%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y")
_TIMES = ("", " %H:%M", " %H:%M:%S", " %I:%M %p", " %I:%M:%S %p")
_CLOCK = re.compile(r"[T ]+\d{1,2}:\d{2}.*$")
_DIGIT = re.compile(r"\d")
_ZONE = re.compile(r"(?<=:\d{2})(\.\d+)?(Z|[+-]\d{2}:?\d{2})$")
# Before and after these nobody measured: a plain number is no date.
_EARLIEST, _LATEST = np.datetime64("1950-01-01"), np.datetime64("2100-01-01")
_REMEDY = "Write dates as in 2026-09-01, year first"


def dates_of(
    labels: Sequence[str] | np.ndarray, of: np.ndarray
) -> tuple[tuple[str, ...], str]:
    """Return the first date of each mounting, as ISO 8601 has it, and a note.

    A mounting that states none, or none that can be read, has an empty one. Nothing is
    returned where most cannot be read, or all in two ways. The note says so.

    Args:
        labels: of each row.
        of: index of each row's mounting, shape (n,).
    """
    if not len(labels):
        return (), ""
    texts, place = _distinct(labels)
    stated = texts != NOT_STATED
    times = np.full(len(texts), np.datetime64("NaT", "s"))
    note = ""
    if stated.any():
        written = texts[stated]
        readings = _readings(written)
        if len(readings) != 1:
            how = "can be read in two ways" if readings else "cannot be read as one"
            return (), f"dates are not used: {quoted(written[0])} {how}. {_REMEDY}"
        times[stated] = readings[0]
        if np.isnat(readings[0]).any():
            odd = quoted(written[int(np.argmax(np.isnat(readings[0])))])
            note = f"the date {odd} cannot be read beside the others. {_REMEDY}"
    first = np.full(int(np.max(of)) + 1, np.datetime64("NaT", "s"))
    np.fmin.at(first, of, times[place])
    if np.isnat(first).all():
        return (), note
    return tuple("" if np.isnat(one) else str(one) for one in first), note


def days_of(labels: np.ndarray) -> np.ndarray:
    """Return the day that each label states, whatever the time.

    Args:
        labels: dates, shape (n,).

    Returns:
        Days as ISO 8601 has them, as they are written where that can be read in two
        ways, and as not stated where they cannot be read.
    """
    stamps, place = _distinct(labels)
    # Few days have many times.
    texts, day = _distinct([day_text(text) for text in stamps])
    days = np.full(len(texts), NOT_STATED, object)
    stated = np.flatnonzero(texts != NOT_STATED)
    readings = _readings(texts[stated]) if len(stated) else []
    if len(readings) > 1:
        days[stated] = texts[stated]
    elif readings:
        read = ~np.isnat(readings[0])
        days[stated[read]] = readings[0][read].astype("datetime64[D]").astype(str)
    return days[day][place]


def _distinct(labels: Sequence[str] | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return labels without repetition, and the index of each among them, (n,)."""
    return np.unique(np.array(labels, object), return_inverse=True)


def day_text(text: str) -> str:
    """Return a date as it is written, without its time."""
    return _CLOCK.sub("", text)


def _readings(texts: Sequence[str] | np.ndarray) -> list[np.ndarray]:
    """Return in how many ways texts can be read, most of them at least, as times."""
    import pandas as pd

    found: list[np.ndarray] = []
    # The local time counts; and a text without a number, such as today, is no date.
    plain = pd.Series(
        [_ZONE.sub("", text) if _DIGIT.search(text) else "" for text in texts]
    )
    for day in _DAYS:
        times = pd.Series(pd.NaT, index=plain.index, dtype="datetime64[s]")
        for time in _TIMES if "%" in day else ("",):
            if not (rest := times.isna()).any():
                break
            read = pd.to_datetime(plain[rest], format=day + time, errors="coerce")
            times[rest] = read.astype("datetime64[s]")
        each = times.to_numpy().astype("datetime64[s]")
        each[~((each > _EARLIEST) & (each < _LATEST))] = np.datetime64("NaT", "s")
        found.append(each)
    # The way in which the fewest are left unread, and all others that leave as few.
    least = min(int(np.isnat(times).sum()) for times in found)
    best = [times for times in found if np.isnat(times).sum() == least]
    if 2 * least >= len(texts):
        return []
    alike = [np.array_equal(best[0], each, equal_nan=True) for each in best]
    return best[:1] if all(alike) else best
