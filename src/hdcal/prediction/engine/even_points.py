"""Points that fill a cube evenly: Sobol's, without what importing SciPy's costs.

SciPy has them in `scipy.stats`, which takes longer to import than a prediction to
compute; tests hold these against them.

Source:
    Bratley and Fox, ACM TOMS 14 (1988), 88; Joe and Kuo, SIAM J. Sci. Comput. 30
    (2008), 2635, table new-joe-kuo-6.21201; Owen, J. Complexity 14 (1998), 466,
    digital shifts.
"""

import numpy as np

# Of each dimension but the first: inner coefficients of its primitive polynomial, as
# bits, and the first odd numbers of its directions.
_STARTS = ((0, (1,)), (1, (1, 3)), (1, (1, 3, 1)), (2, (1, 1, 1)), (1, (1, 1, 3, 3)))
MOST_COLUMNS = 1 + len(_STARTS)
_BITS = 32


def spread_evenly(count: int, columns: int, seed: int) -> np.ndarray:
    """Return points that fill the unit cube evenly, (count, columns), none at 0 or 1.

    Args:
        count: of the points.
        columns: dimensions, at most `MOST_COLUMNS`.
        seed: of the shift of all of them.
    """
    shift = np.random.default_rng(seed).integers(1 << _BITS, size=columns)
    points = sobol_integers(count, columns) ^ shift
    return (points + 0.5) / (1 << _BITS)


def sobol_integers(count: int, columns: int) -> np.ndarray:
    """Return Sobol's points times 2³², unshifted, (count, columns)."""
    index = np.arange(count)
    gray = index ^ (index >> 1)
    found = np.zeros((count, columns), np.int64)
    for column in range(columns):
        for bit, direction in enumerate(_directions(column)):
            found[:, column] ^= (gray >> bit & 1) * direction
    return found


def _directions(column: int) -> list[int]:
    """Return what each bit of an index adds to a coordinate, times 2³²."""
    if column == 0:
        odd = [1] * _BITS
    else:
        inner, starts = _STARTS[column - 1]
        degree, odd = len(starts), list(starts)
        while len(odd) < _BITS:
            new = odd[-degree] ^ (odd[-degree] << degree)
            for back in range(1, degree):
                new ^= (inner >> (degree - 1 - back) & 1) * odd[-back] << back
            odd.append(new)
    return [number << (_BITS - 1 - bit) for bit, number in enumerate(odd)]
