"""Local structure outside the library: one stretch of rows, or one period.

Each family of directions enters with its likeliest member, whose prior is divided by
the size of the family.
"""

import numpy as np
from jaxtyping import Float

from hdcal.evidence.components import Space
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.remainder import remainder_space

Family = Float[np.ndarray, "f 2 n"]

# Shortest stretch as a share of all rows; most periods, by rows and by the clock.
_FINEST, _MOST_PERIODS, _MOST_BY_TIME = 1.0 / 32.0, 96, 384
# Rows are uneven in time where the longest step is so many median ones; pauses count
# as at most so many.
_UNEVEN, _LONGEST_PAUSE = 1.5, 30.0


def local_families(problem: LinearProblem) -> list[Family]:
    """Return families of directions: stretches in two orders, periods, by the clock."""
    count = len(problem.y)
    deformation = np.asarray(problem.records.deformation)
    slope = deformation / deformation[np.argmax(np.abs(deformation))]
    found = []
    for path in (np.arange(count), np.argsort(slope, kind="stable")):
        inside = _stretches(count)
        table = np.zeros_like(inside)
        table[:, path] = inside
        # A stretch may be off by a force or by a part of the stiffness.
        found.append(np.stack([table, table * slope], axis=1))
    found.append(_waves(np.arange(count) / count, min(count // 2, _MOST_PERIODS)))
    found += _by_the_clock(problem)
    return [family for family in found if len(family)]


def _by_the_clock(problem: LinearProblem) -> list[Family]:
    """Return periods in time, where rows are uneven in it."""
    records = problem.records
    step = np.maximum(np.diff(np.asarray(records.time, float)), 0.0)
    step[np.diff(np.asarray(records.run)) != 0] = 0.0
    moves = step[step > 0.0]
    if "time" not in records.known or not len(moves):
        return []
    usual = float(np.median(moves))
    if np.max(moves) < _UNEVEN * usual:
        return []
    step = np.minimum(step, _LONGEST_PAUSE * usual)
    place = np.concatenate([[0.0], np.cumsum(step)]) / np.sum(step)
    return [_waves(place, min(int(0.5 * np.sum(step) / usual), _MOST_BY_TIME))]


def _stretches(count: int) -> Float[np.ndarray, "f n"]:
    """Return indicators of stretches that overlap by half, each half as long."""
    length, found = count // 2, [np.zeros((0, count))]
    while length >= max(2, count * _FINEST):
        starts = np.arange(0, count - length + 1, max(length // 2, 1))
        place = np.arange(count) - starts[:, None]
        found.append(((place >= 0) & (place < length)).astype(float))
        length //= 2
    return np.concatenate(found)


def _waves(place: Float[np.ndarray, " n"], most: int) -> Family:
    turns = 2.0 * np.pi * np.arange(2, most + 1)[:, None] * place
    return np.stack([np.cos(turns), np.sin(turns)], axis=1)


def likeliest_members(
    problem: LinearProblem, families: list[Family], owner: int
) -> list[Space]:
    """Return the member of each family that the readings show most.

    Args:
        problem: the case, its base with all that is taken as known.
        families: of pairs of directions.
        owner: index of the remainder among the components.
    """
    error = problem.project(problem.y)
    half = np.linalg.solve(problem.root.T, problem.X.T).T
    found = []
    for family in families:
        # One large product of matrices, not many small ones.
        along = family.reshape(-1, len(error)) @ np.column_stack([half, error])
        along = along.reshape(len(family), 2, -1)
        inside = along[..., :-1]
        gram = family @ np.swapaxes(family, 1, 2) - inside @ np.swapaxes(inside, 1, 2)
        (a, b), (_, d) = np.moveaxis(gram, 0, -1)
        ridge = 1e-9 * np.max(a + d)
        a, d = a + ridge, d + ridge
        one, two = along[..., -1].T
        # Decrease of the squared error by the best combination of both directions.
        gain = (d * one**2 - 2.0 * b * one * two + a * two**2) / (a * d - b**2)
        best = problem.project(family[int(np.argmax(gain))])
        size = np.sqrt(np.sum(np.mean(best**2, axis=1)))
        if size > 0.0:
            space = remainder_space(problem, owner, best / size, len(family))
            found.append(space)
    return found
