"""Proper scores of stated probabilities: the best is who states what he believes."""

import math

from hdcal.blind.scoring.estimates import Estimate, mean
from hdcal.blind.scoring.scored_case import Cases

# No single case may weigh more than this: log 1e-6 = -13.8 nat.
FLOOR = 1e-6


def log_score(cases: Cases) -> Estimate:
    """Return the mean log probability of the truth [nat]; 0 is perfect.

    Real data, which has no single truth, is left out, here and in `brier_score`.
    """
    return mean(
        [
            math.log(min(max(case.probabilities.get(case.truth, 0.0), FLOOR), 1.0))
            for case in cases
            if case.truth is not None
        ]
    )


def brier_score(cases: Cases) -> Estimate:
    """Return the mean squared distance from the truth, 0 to 2; 0 is perfect."""
    return mean(
        [
            math.fsum(
                (case.probabilities.get(name, 0.0) - (name == case.truth)) ** 2
                for name in {*case.probabilities, case.truth}
            )
            for case in cases
            if case.truth is not None
        ]
    )
