"""Proper scores of stated probabilities: best is who says what he believes."""

import math
from collections.abc import Sequence

from hdcal.blind.scoring.estimates import Estimate, mean
from hdcal.blind.scoring.judged import Judged

# No single case may weigh more than this: log 1e-6 = -13.8 nat.
FLOOR = 1e-6


def log_scores(cases: Sequence[Judged]) -> list[float]:
    """Return the log probability of the truth of each case that has one [nat]."""
    return [
        math.log(min(max(case.probabilities.get(case.truth, 0.0), FLOOR), 1.0))
        for case in cases
        if case.truth is not None
    ]


def brier_scores(cases: Sequence[Judged]) -> list[float]:
    """Return the squared distance from the truth over all hypotheses, 0 to 2."""
    return [
        math.fsum(
            (case.probabilities.get(name, 0.0) - (name == case.truth)) ** 2
            for name in {*case.probabilities, case.truth}
        )
        for case in cases
        if case.truth is not None
    ]


def log_score(cases: Sequence[Judged]) -> Estimate:
    """Return the mean log score [nat]; 0 is perfect."""
    return mean(log_scores(cases))


def brier(cases: Sequence[Judged]) -> Estimate:
    """Return the mean Brier score; 0 is perfect."""
    return mean(brier_scores(cases))
