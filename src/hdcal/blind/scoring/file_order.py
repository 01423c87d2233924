"""Whether answers depend on where in the folder a case lies.

The cases are shuffled, so that beside the truth their order holds nothing. Answers
are dealt anew among cases with the same truth; that keeps how good a diagnoser is and
takes away what it may have from the neighbours. Two things are compared: how often
neighbours get the same answer, and how often an answer is what is true next door.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from hdcal.blind.scoring.estimates import SEED, share
from hdcal.blind.scoring.scored_case import Cases

_PERMUTATIONS = 1000


def order_dependence(cases: Cases) -> dict[str, Any]:
    """Return how answers go with the order of the files, by a permutation test.

    Args:
        cases: in any order; names of cases, sorted, make the order of the files.

    Returns:
        p_value (Bonferroni over both comparisons; None with fewer than three
        cases), each comparison with what is expected, the same test of the truth
        alone, and the share of right answers in both halves.
    """
    found = sorted((c for c in cases if c.truth), key=lambda c: c.label.case)
    truth = _codes([str(case.truth) for case in found])
    both = _codes([str(c.truth) for c in found] + [c.stated for c in found])
    true, stated = both[: len(found)], both[len(found) :]
    half = len(found) // 2
    right = stated == true
    result = {
        "n": len(found),
        "p_value": None,
        "first_half_right": share(right[:half]).plain(),
        "second_half_right": share(right[half:]).plain(),
    }
    if len(found) < 3:
        return result
    same = _tested(lambda a: _agree(a, a), stated, truth)
    next_truth = _tested(lambda a: _agree(a, true) + _agree(true, a), stated, truth)
    return {
        **result,
        "p_value": min(1.0, 2.0 * min(same["p_value"], next_truth["p_value"])),
        "same_as_neighbour": same,
        "truth_of_neighbour": next_truth,
        "truth_itself": _tested(lambda a: _agree(a, a), true, np.zeros_like(true)),
    }


def _codes(names: list[str]) -> np.ndarray:
    return np.unique(np.array(names, dtype=object).astype(str), return_inverse=True)[1]


def _agree(one: np.ndarray, two: np.ndarray) -> int:
    """Count the cases whose `one` is the next case's `two`."""
    return int(np.sum(one[:-1] == two[1:]))


def _tested(
    statistic: Callable[[np.ndarray], int], values: np.ndarray, group: np.ndarray
) -> dict[str, Any]:
    """Return a count, what permuting within groups gives, and how often as many."""
    rng = np.random.default_rng(SEED)
    own = np.argsort(group, kind="stable")
    counts = np.empty(_PERMUTATIONS)
    for place in range(_PERMUTATIONS):
        permuted = np.empty_like(values)
        permuted[own] = values[np.lexsort((rng.random(len(values)), group))]
        counts[place] = statistic(permuted)
    seen = statistic(values)
    return {
        "seen": seen,
        "expected": float(counts.mean()),
        "p_value": float((1 + np.sum(counts >= seen)) / (1 + _PERMUTATIONS)),
    }
