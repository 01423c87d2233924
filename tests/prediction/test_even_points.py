"""Sobol's points are those of SciPy; a shift moves them and keeps them even."""

import numpy as np
import pytest
from scipy.stats import qmc

from hdcal.prediction.engine.even_points import (
    MOST_COLUMNS,
    sobol_integers,
    spread_evenly,
)


@pytest.mark.parametrize("columns", [1, 2, MOST_COLUMNS])
def test_they_are_those_of_scipy(columns: int):
    theirs = qmc.Sobol(columns, scramble=False, bits=32).random(2048)
    assert (sobol_integers(2048, columns) / 2.0**32 == theirs).all()
    assert (sobol_integers(1500, columns) / 2.0**32 == theirs[:1500]).all()


def test_shifted_points_have_each_part_of_every_axis_once():
    found = spread_evenly(256, MOST_COLUMNS, seed=3)
    assert found.shape == (256, MOST_COLUMNS)
    assert np.all((found > 0.0) & (found < 1.0))
    parts = np.sort(np.floor(256 * found), axis=0)
    assert (parts == np.arange(256)[:, None]).all()


def test_they_are_more_even_than_random_ones():
    found = [qmc.discrepancy(spread_evenly(1024, 6, seed)) for seed in range(8)]
    random = [np.random.default_rng(seed).random((1024, 6)) for seed in range(8)]
    assert max(found) < 0.2 * min(map(qmc.discrepancy, random))


def test_the_seed_tells_which():
    first, other = (spread_evenly(64, 3, seed) for seed in (0, 1))
    assert (first == spread_evenly(64, 3, 0)).all()
    assert not np.any(first == other)
