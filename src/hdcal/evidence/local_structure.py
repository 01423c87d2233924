"""Structure that no smooth function shows: in a stretch of rows, or with a period.

Stretches are dyadic windows along each order of the rows; periods are those of
Fourier's, from row to row and by the clock: mains and thermostats know nothing of rows.
They are too many for an evidence of each: of each family the direction that
the data show most represents all, and its evidence is divided by their number, which
is a lower bound of the family's own.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hdcal.data.records import Records
from hdcal.evidence.linear_rows import remove_base
from hdcal.evidence.prepare import PreparedCase

# Windows are no shorter than this many rows, nor than this share of all.
_SHORTEST, _FINEST = 2, 1.0 / 32.0
_MOST_PERIODS, _MOST_BY_TIME = 96, 384
# Rows are uneven in time where a step is this many times a usual one. A pause counts as
# no more than this many: over a long one no period keeps its phase.
_UNEVEN, _PAUSE = 1.5, 30.0


@dataclass(frozen=True)
class DirectionFamily:
    """Directions of one kind.

    Attributes:
        name: for the table of kernels.
        columns: shape (m, n); a family member has `width` of them in a row.
        width: columns of each member.
    """

    name: str
    columns: np.ndarray
    width: int


def direction_families(records: Records) -> list[DirectionFamily]:
    """Return every family of local or periodic directions.

    Args:
        records: rows, run after run.
    """
    rows = len(records.force)
    order = np.arange(rows)
    # Of one sign where it is largest: compression may be read as negative.
    deformation = np.asarray(records.deformation)
    deformation = deformation / deformation[np.argmax(np.abs(deformation))]
    paths = {"order": order, "deformation": np.argsort(deformation, kind="stable")}
    found = []
    for name, path in paths.items():
        inside = _windows(rows)
        table = np.zeros_like(inside)
        table[:, path] = inside
        # A stretch may be off by a force, or by a part of the stiffness.
        pairs = np.stack([table, table * deformation], axis=1).reshape(-1, rows)
        found.append(DirectionFamily(f"stretch of {name}", pairs, 2))
    count = min(rows // 2, _MOST_PERIODS)
    found.append(DirectionFamily("period", _waves(order / rows, count), 2))
    clock = _clock(records)
    if clock is not None:
        found.append(DirectionFamily("period of time", _waves(*clock), 2))
    return found


def _clock(records: Records) -> tuple[np.ndarray, int] | None:
    """Return when each row was read, from 0 to 1, and how many turns rows can show.

    None where the time is not known, or says no more than the order of the rows.
    """
    step = np.maximum(np.diff(np.asarray(records.time, float)), 0.0)
    # Each run has a clock of its own.
    step[np.diff(np.asarray(records.run)) != 0] = 0.0
    moves = step[step > 0.0]
    if "time" not in records.known or not len(moves):
        return None
    usual = float(np.median(moves))
    if np.max(moves) < _UNEVEN * usual:
        return None
    step = np.minimum(step, _PAUSE * usual)
    whole = float(np.sum(step))
    at = np.concatenate([[0.0], np.cumsum(step)]) / whole
    return at, min(int(0.5 * whole / usual), _MOST_BY_TIME)


def _waves(place: np.ndarray, most: int) -> np.ndarray:
    """Return cosine and sine of 2 and more turns over a place from 0 to 1."""
    turns = 2.0 * np.pi * np.arange(2, most + 1)[:, None] * place
    return np.stack([np.cos(turns), np.sin(turns)], axis=1).reshape(-1, len(place))


def _windows(rows: int) -> np.ndarray:
    """Return 1 inside each window of half-overlapping dyadic lengths, shape (m, n)."""
    length = rows // 2
    found = [np.zeros((0, rows))]
    while length >= max(_SHORTEST, rows * _FINEST):
        starts = np.arange(0, rows - length + 1, max(length // 2, 1))
        place = np.arange(rows) - starts[:, None]
        found.append(((place >= 0) & (place < length)).astype(float))
        length //= 2
    return np.concatenate(found)


def likeliest_directions(
    case: PreparedCase, families: Iterable[DirectionFamily]
) -> list[tuple[str, np.ndarray, float]]:
    """Return of each family the member that the data show most.

    Args:
        case: whose readings choose.
        families: of its records.

    Returns:
        Name, columns (width, n) and log of the number of members.
    """
    rows = case.rows
    error = remove_base(rows, rows.reading[None])[0]
    found = []
    for family in families:
        left = remove_base(rows, family.columns)
        table = left.reshape(-1, family.width, left.shape[-1])
        if not len(table):
            continue
        gram = np.einsum("mkn,mln->mkl", table, table)
        ridge = 1e-9 * np.trace(gram, axis1=1, axis2=2).max() * np.eye(family.width)
        along = table @ error
        gained = np.linalg.solve(gram + ridge, along[..., None])[..., 0]
        best = int(np.argmax(np.sum(along * gained, axis=1)))
        start = best * family.width
        columns = family.columns[start : start + family.width]
        found.append((family.name, columns, float(np.log(len(table)))))
    return found
