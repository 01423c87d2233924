"""Risks of accepting what does not conform.

JCGM 106:2012, clauses 7 and 9.
"""

import numpy as np
import scipy
from scipy.special import ndtr

# Beyond so many sds of the production there is nothing.
_REACH = 12.0


def global_false_accept(
    mean: float, production_sd: float, measurement_sd: float, limit: float, most: float
) -> float:
    """Return how probable it is that a member exceeds a limit and is accepted.

    Members of a production differ normally, and each is measured with a normal error:
    ∫ over y > limit of φ((y − mean)/u₀)/u₀ · Φ((most − y)/u_m) dy.

    Args:
        mean: of the production.
        production_sd: u₀.
        measurement_sd: u_m, of one measurement.
        limit: that a member must not exceed.
        most: largest measured value that is accepted.
    """
    if not production_sd > 0.0:
        known = float(mean <= most)
        accepted = (
            ndtr((most - mean) / measurement_sd) if measurement_sd > 0.0 else known
        )
        return float(accepted) if mean > limit else 0.0

    def density(score: float) -> float:
        room = most - mean - production_sd * score
        sure = np.heaviside(room, 1.0) if not measurement_sd > 0.0 else None
        accepted = ndtr(room / measurement_sd) if sure is None else sure
        return float(np.exp(-0.5 * score**2) / np.sqrt(2.0 * np.pi) * accepted)

    start = max((limit - mean) / production_sd, -_REACH)
    if start >= _REACH:
        return 0.0
    return float(scipy.integrate.quad(density, start, _REACH, limit=200)[0])
