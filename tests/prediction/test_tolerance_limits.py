"""With the reference prior, bounds are the published normal tolerance limits."""

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc

from hdcal.prediction.members import Members, over_draws

# One-sided normal factors at 95 % confidence, Owen (1963), Sandia SCR-607; to two
# or three decimals also CMH-17, vol. 1, tables of k_B and k_A.
PUBLISHED = {5: (3.407, 5.741), 10: (2.355, 3.981), 30: (1.777, 3.064)}


def factor(size: int, content: float, narrowed: float = 1.0) -> float:
    """Return the bound on a sample of mean 0 and sd 1 under the prior 1/σ."""
    points = qmc.Sobol(2, seed=1).random_base2(18)
    points = np.clip(points, 1e-12, 1.0 - 1e-12)
    sd = np.sqrt((size - 1) / stats.chi2.ppf(points[:, 0], size - 1))
    mean = sd / np.sqrt(size) * stats.norm.ppf(points[:, 1])
    members = Members(
        np.full(len(sd), 1.0 / len(sd)),
        np.ones((len(sd), 1)),
        mean[:, None, None],
        narrowed * sd[:, None, None],
    )
    return float(over_draws(members.quantile(content), members.weight, [0.95])[0, 0])


@pytest.mark.parametrize("size", PUBLISHED)
@pytest.mark.parametrize(("column", "content"), [(0, 0.90), (1, 0.99)])
def test_the_bound_is_the_classical_one(size: int, column: int, content: float):
    published = PUBLISHED[size][column]
    assert factor(size, content) == pytest.approx(published, abs=1e-3)
    # A population that is assumed 2 % too narrow is noticed.
    assert abs(factor(size, content, 0.98) - published) > 1e-2
