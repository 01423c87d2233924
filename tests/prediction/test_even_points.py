import numpy as np

from hdcal.prediction.engine.even_points import spread_evenly


def test_each_part_of_every_axis_holds_one_point():
    found = spread_evenly(256, 28, seed=3)
    assert np.all((found > 0.0) & (found < 1.0))
    parts = np.sort(np.floor(256 * found), axis=0)
    assert (parts == np.arange(256)[:, None]).all()


def test_the_seed_and_no_length_determines_them():
    first, other = spread_evenly(64, 3, 0), spread_evenly(64, 3, 1)
    assert (first[:50] == spread_evenly(50, 3, 0)).all()
    assert not np.any(first == other)
