"""Scrambled Sobol' points."""

import numpy as np
from scipy.stats import qmc

_BITS = 32


def spread_evenly(count: int, columns: int, seed: int) -> np.ndarray:
    """Return points that fill the unit cube evenly, (count, columns), none at 0 or 1.

    Args:
        count: of the points.
        columns: dimensions.
        seed: of their scrambling.
    """
    sobol = qmc.Sobol(columns, bits=_BITS, rng=np.random.default_rng(seed))
    return sobol.random_base2((count - 1).bit_length())[:count] + 0.5 ** (_BITS + 1)
