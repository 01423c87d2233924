"""Whether answers depend on where in the folder a case lies.

The cases are shuffled, so that beside the truth their order holds nothing. Answers
are dealt anew among cases with the same truth; that keeps how good a diagnoser is and
takes away what it may have from the neighbours. Two things are compared: how often
neighbours get the same answer, and how often an answer is what is true next door.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hdcal.blind.scoring.estimates import SEED, share
from hdcal.blind.scoring.judged import Judged

_DEALS = 1000


def order_dependence(cases: Sequence[Judged]) -> dict[str, Any]:
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
    spoken = [case.spoken for case in found]
    both = _codes([str(case.truth) for case in found] + spoken)
    true, said = both[: len(found)], both[len(found) :]
    half = len(found) // 2
    right = said == true
    result = {
        "n": len(found),
        "p_value": None,
        "first_half_right": share(right[:half]).plain(),
        "second_half_right": share(right[half:]).plain(),
    }
    if len(found) < 3:
        return result
    same = _compared(lambda a: _agree(a, a), said, truth)
    next_door = _compared(lambda a: _agree(a, true) + _agree(true, a), said, truth)
    shuffled = _compared(lambda a: _agree(a, a), true, np.zeros_like(true))
    chance = min(1.0, 2.0 * min(same["p_value"], next_door["p_value"]))
    return {
        **result,
        "p_value": chance,
        "same_as_neighbour": same,
        "truth_of_neighbour": next_door,
        "truth_itself": shuffled,
    }


def _codes(names: list[str]) -> np.ndarray:
    return np.unique(np.array(names, dtype=object).astype(str), return_inverse=True)[1]


def _agree(one: np.ndarray, two: np.ndarray) -> int:
    """Count the cases whose `one` is the next case's `two`."""
    return int(np.sum(one[:-1] == two[1:]))


def _compared(statistic, said: np.ndarray, truth: np.ndarray) -> dict[str, Any]:
    """Return a count, what dealing anew would give, and how often as many."""
    rng = np.random.default_rng(SEED)
    own = np.argsort(truth, kind="stable")
    counts = np.empty(_DEALS)
    for deal in range(_DEALS):
        dealt = np.empty_like(said)
        dealt[own] = said[np.lexsort((rng.random(len(said)), truth))]
        counts[deal] = statistic(dealt)
    seen = statistic(said)
    return {
        "seen": seen,
        "expected": float(counts.mean()),
        "p_value": float((1 + np.sum(counts >= seen)) / (1 + _DEALS)),
    }
