"""Points that fill a cube evenly: Sobol's, without what importing SciPy's costs.

SciPy has them in `scipy.stats`, which takes longer to import than a prediction to
compute; tests hold these against them.

Source:
    Bratley and Fox, ACM TOMS 14 (1988), 88; Joe and Kuo, SIAM J. Sci. Comput. 30
    (2008), 2635, table new-joe-kuo-6.21201; Matoušek, J. Complexity 14 (1998), 527,
    linear scrambling and digital shifts.
"""

from collections.abc import Sequence

import numpy as np

# Of each dimension but the first: inner coefficients of its primitive polynomial, as
# bits, and the first odd numbers of its directions.
_STARTS = (
    (0, (1,)),
    (1, (1, 3)),
    (1, (1, 3, 1)),
    (2, (1, 1, 1)),
    (1, (1, 1, 3, 3)),
    (4, (1, 3, 5, 13)),
    (2, (1, 1, 5, 5, 17)),
    (4, (1, 1, 5, 5, 5)),
    (7, (1, 1, 7, 11, 19)),
    (11, (1, 1, 5, 1, 1)),
    (13, (1, 1, 1, 3, 11)),
    (14, (1, 3, 5, 5, 31)),
    (1, (1, 3, 3, 9, 7, 49)),
    (13, (1, 1, 1, 15, 21, 21)),
    (16, (1, 3, 1, 13, 27, 49)),
    (19, (1, 1, 1, 15, 7, 5)),
    (22, (1, 3, 1, 15, 13, 25)),
    (25, (1, 1, 5, 5, 19, 61)),
    (1, (1, 3, 7, 11, 23, 15, 103)),
    (4, (1, 3, 7, 13, 13, 15, 69)),
    (7, (1, 1, 3, 13, 7, 35, 63)),
    (8, (1, 3, 5, 9, 1, 25, 53)),
    (14, (1, 3, 1, 13, 9, 35, 107)),
    (19, (1, 3, 1, 5, 27, 61, 31)),
    (21, (1, 1, 5, 11, 19, 41, 61)),
    (28, (1, 3, 5, 3, 3, 13, 69)),
    (31, (1, 1, 7, 13, 1, 19, 1)),
)
MOST_COLUMNS = 1 + len(_STARTS)
_BITS = 32


def spread_evenly(count: int, columns: int, seed: int) -> np.ndarray:
    """Return points that fill the unit cube evenly, (count, columns), none at 0 or 1.

    Args:
        count: of the points.
        columns: dimensions, at most `MOST_COLUMNS`.
        seed: of their scrambling.
    """
    rng = np.random.default_rng(seed)
    directions = [_scrambled(_directions(column), rng) for column in range(columns)]
    shift = rng.integers(1 << _BITS, size=columns)
    return ((_combined(count, directions) ^ shift) + 0.5) / (1 << _BITS)


def sobol_integers(count: int, columns: int) -> np.ndarray:
    """Return Sobol's points times 2³² as they are, (count, columns)."""
    return _combined(count, [_directions(column) for column in range(columns)])


def _combined(count: int, directions: Sequence[Sequence[int]]) -> np.ndarray:
    """Return points times 2³² from what each bit of their index adds."""
    index = np.arange(count)
    gray = index ^ (index >> 1)
    found = np.zeros((count, len(directions)), np.int64)
    for column, each in enumerate(directions):
        for bit, direction in enumerate(each):
            found[:, column] ^= (gray >> bit & 1) * direction
    return found


def _scrambled(directions: Sequence[int], rng: np.random.Generator) -> list[int]:
    """Return directions of which each digit has a random part of those above added.

    Points stay as even, and what they have in common within their cells is gone.
    """
    found = [0] * len(directions)
    for digit in range(_BITS):
        own = 1 << (_BITS - 1 - digit)
        taken = own | int(rng.integers(1 << digit)) << (_BITS - digit)
        for place, direction in enumerate(directions):
            found[place] |= own * ((direction & taken).bit_count() & 1)
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
