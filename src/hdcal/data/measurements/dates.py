"""Dates of mountings, as rigs and people write them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.tables.cells import NOT_STATED
from hdcal.errors import quoted

# Forms of days; behind points the month stands second, behind slashes anywhere.
_DAYS = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y")
# A day and a time of day; the local time counts, whatever its zone.
_STAMP = r"^([\d./-]+)(?:[T ]+(\d{1,2}:\d\d(?::\d\d)?(?:\s*[AP]M)?).*)?$"
# Before and after these nobody measured: a plain number is no date.
_EARLIEST, _LATEST = pd.Timestamp("1950-01-01"), pd.Timestamp("2100-01-01")
_REMEDY = "Write dates as in 2026-09-01, year first"


def dates_of(
    labels: Sequence[str] | np.ndarray, of: np.ndarray
) -> tuple[tuple[str, ...], str]:
    """Return the first date of each mounting in ISO 8601, and a note.

    A mounting that states none, or none that can be read, has an empty one. No dates
    are returned, and the note says so, where most cannot be read, or all in two ways.

    Args:
        labels: date of each row, shape (n,).
        of: index of each row's mounting, shape (n,).
    """
    place, texts = pd.factorize(np.array(labels, object))
    stated: Any = texts != NOT_STATED
    if not stated.any():
        return (), ""
    written, note = texts[stated], ""
    ways = _ways(written)
    if len(ways) != 1:
        how = "can be read in two ways" if ways else "cannot be read as one"
        return (), f"dates are not used: {quoted(written[0])} {how}. {_REMEDY}"
    if (unread := ways[0].isna().to_numpy()).any():
        odd = quoted(written[int(np.argmax(unread))])
        note = f"the date {odd} cannot be read like the others. {_REMEDY}"
    times: Any = pd.Series(pd.NaT, range(len(texts)), "datetime64[s]")
    times[stated] = ways[0].to_numpy()
    first = times[place].groupby(np.asarray(of)).min()
    return tuple("" if pd.isna(one) else one.isoformat() for one in first), note


def days_of(labels: np.ndarray) -> np.ndarray:
    """Return the day that each label states, whatever the time.

    Args:
        labels: dates, shape (n,).

    Returns:
        Days in ISO 8601, as written where that can be read in two ways, and
        `NOT_STATED` where they cannot be read, shape (n,).
    """
    place, texts = pd.factorize(np.array(labels, object))
    days = np.full(len(texts), NOT_STATED, object)
    stated = np.flatnonzero(texts != NOT_STATED)
    ways = _ways(texts[stated]) if len(stated) else []
    if len(ways) > 1:
        days[stated] = pd.Series(texts[stated]).str.extract(_STAMP)[0]
    elif ways:
        read = ways[0].notna().to_numpy()
        days[stated[read]] = ways[0][read].dt.strftime("%Y-%m-%d")
    return days[place]


def _ways(texts: np.ndarray) -> list[Any]:
    """Return texts as times, in each of the ways in which most of them can be read."""
    parts = pd.Series(texts).str.extract(_STAMP)
    clock: Any = pd.to_datetime(parts[1], format="mixed", errors="coerce")
    clock = (clock - clock.dt.normalize()).fillna(pd.Timedelta(0))
    ways: list[Any] = []
    for form in _DAYS:
        times = pd.to_datetime(parts[0], format=form, errors="coerce")
        times = times.where((times > _EARLIEST) & (times < _LATEST))
        ways.append((times + clock).astype("datetime64[s]"))
    # The way that leaves the fewest unread, and all others that leave as few.
    least = min(int(times.isna().sum()) for times in ways)
    if 2 * least >= len(texts):
        return []
    best = [times for times in ways if times.isna().sum() == least]
    return best[:1] if all(best[0].equals(each) for each in best) else best
