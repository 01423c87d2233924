"""Probability of exceedance with its Monte Carlo error, or an upper limit of it."""

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtri

from hdcal.prediction.margin.result import Exceedance
from hdcal.prediction.members import over_draws
from hdcal.prediction.models import Model
from hdcal.prediction.shares import RAREST
from hdcal.report.item import TAILS

# Largest relative Monte Carlo error of a probability that is a number. Of an event that
# n independent draws do not show, the probability is below 3/n with 95 % confidence.
_ROUGH, _UNSEEN = 0.3, 3.0


def exceedance(
    above: np.ndarray, weight: np.ndarray, found: Sequence[Model], confidence: float
) -> Exceedance:
    """Return the probability of exceedance.

    Args:
        above: share of the members above the limit in each draw, (3, draw): at the
            least, on average and at the most, by the place of the force in a step.
        weight: of the draws, (draw,).
        found: models of the draws, in this order.
        confidence: of the share that is not exceeded.
    """
    least, usual, most = above
    mean = float(weight @ usual)
    # Each draw counts for less where draws depend on each other.
    less = np.concatenate(
        [np.full(m.size, (m.size / m.independent_draws) ** 0.5) for m in found]
    )
    error = float(np.linalg.norm(less * weight * (usual - mean)))
    independent = 1.0 / sum(m.probability**2 / m.independent_draws for m in found)
    # Without scatter no draw may lie above the limit: that is no probability of zero.
    rough = error > _ROUGH * mean or mean == 0.0
    resolved = not rough and mean >= RAREST
    if rough:
        mean = min(mean + _UNSEEN / independent, 1.0)
    (low,) = over_draws(least[:, None], weight, [TAILS[0]])[:, 0]
    high, sure = over_draws(most[:, None], weight, [TAILS[2], confidence])[:, 0]
    mean = min(max(mean, RAREST), 1.0)
    return Exceedance(
        probability=mean,
        error=error,
        resolved=resolved,
        lo=float(low),
        hi=float(high),
        at_confidence=float(sure),
        beta=float(-ndtri(min(mean, 1.0 - 1e-16))),
    )
