"""Whether answers depend on where in the folder a case lies.

The cases are shuffled, so that beside the truth their order holds nothing. Answers
are dealt anew among cases with the same truth; that keeps how good a diagnoser is and
takes away what it may have from the neighbours. Two things are compared: how often
neighbours get the same answer, and how often an answer is what is true next door.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.blind.scoring.estimates import SEED, Estimate, share
from hdcal.blind.scoring.scored_case import Cases

_PERMUTATIONS = 1000


@dataclass(frozen=True)
class PermutationTest:
    """A count, its mean over permutations, and how often they give as many."""

    seen: int
    expected: float
    p_value: float


@dataclass(frozen=True)
class FileOrder:
    """How answers go with the order of the files; of few cases no more than this.

    Attributes:
        n: number of cases.
        p_value: that they do not, Bonferroni over both comparisons; None with fewer
            than three cases.
        first_half_right: share of right answers.
        second_half_right: the same.
    """

    n: int
    p_value: float | None
    first_half_right: Estimate
    second_half_right: Estimate


@dataclass(frozen=True)
class NeighbourTests(FileOrder):
    """The same with both comparisons, and with the first one of the truth alone."""

    same_as_neighbour: PermutationTest
    truth_of_neighbour: PermutationTest
    truth_itself: PermutationTest


def order_dependence(cases: Cases) -> FileOrder:
    """Return how answers go with the order of the files, by a permutation test.

    Args:
        cases: in any order; names of cases, sorted, make the order of the files.
    """
    found = sorted((c for c in cases if c.truth), key=lambda c: c.label.case)
    truth = _codes([str(case.truth) for case in found])
    both = _codes([str(c.truth) for c in found] + [c.stated for c in found])
    true, stated = both[: len(found)], both[len(found) :]
    half = len(found) // 2
    right = stated == true
    halves = share(right[:half]), share(right[half:])
    if len(found) < 3:
        return FileOrder(len(found), None, *halves)

    def alike(dealt: np.ndarray) -> int:
        return _agree(dealt, dealt)

    def as_next_door(dealt: np.ndarray) -> int:
        return _agree(dealt, true) + _agree(true, dealt)

    same, next_truth = _tested((alike, as_next_door), stated, truth)
    (itself,) = _tested((alike,), true, np.zeros_like(true))
    p_value = min(1.0, 2.0 * min(same.p_value, next_truth.p_value))
    return NeighbourTests(len(found), p_value, *halves, same, next_truth, itself)


def _codes(names: list[str]) -> np.ndarray:
    return np.unique(np.array(names, dtype=object).astype(str), return_inverse=True)[1]


def _agree(one: np.ndarray, two: np.ndarray) -> int:
    """Count the cases whose `one` is the next case's `two`."""
    return int(np.sum(one[:-1] == two[1:]))


def _tested(
    statistics: Sequence[Callable[[np.ndarray], int]],
    values: np.ndarray,
    group: np.ndarray,
) -> list[PermutationTest]:
    """Return counts beside what permuting within groups 0, 1, … gives."""
    rng = np.random.default_rng(SEED)
    own = np.argsort(group, kind="stable")
    counts = np.empty((_PERMUTATIONS, len(statistics)))
    for row in counts:
        permuted = np.empty_like(values)
        # Sorted by group, and at random within each.
        permuted[own] = values[np.argsort(group + rng.random(len(values)))]
        row[:] = [statistic(permuted) for statistic in statistics]
    found = []
    for statistic, column in zip(statistics, counts.T, strict=True):
        seen = statistic(values)
        p_value = (1 + np.sum(column >= seen)) / (1 + _PERMUTATIONS)
        found.append(PermutationTest(seen, float(column.mean()), float(p_value)))
    return found
