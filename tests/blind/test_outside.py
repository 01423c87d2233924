"""Every mechanism outside the library gives a curve of its own, repeatably."""

import itertools

import numpy as np
import pytest

from hdcal.blind.virtual_rig.history import History
from hdcal.blind.virtual_rig.outside import CHOSEN, LATE, LISTED, UNSEEN

MECHANISMS = LISTED | CHOSEN | UNSEEN | LATE
SEEDS = range(5)


def made_history(runs: int = 4, cycles: int = 4, points: int = 20) -> History:
    """Triangular cycles; every run has its own angle and changes its temperature."""
    up = np.linspace(0.02, 0.54, points)
    pair = np.concatenate([up, up[::-1]])
    run, cycle, row = np.indices((runs, cycles, len(pair))).reshape(3, -1)
    deformation = np.tile(pair, runs * cycles)
    sense = np.where(row < points, 1.0, -1.0)
    return History(
        deformation=deformation,
        temperature=np.where((cycle < cycles / 2) ^ (run % 2 == 1), 20.0, 60.0),
        time=10.0 * (cycle * len(pair) + row),
        angle=np.pi / 4 * run,
        direction=sense,
        sense=sense,
        cycle=run * cycles + cycle,
        run=run,
        specimen=np.zeros(len(deformation), int),
        force=200.0 * deformation,
    )


HISTORY = made_history()


def drawn(name: str, seed: int, history: History = HISTORY) -> np.ndarray:
    return MECHANISMS[name](history, np.random.default_rng(seed))


def left_over(curve: np.ndarray) -> np.ndarray:
    """The curve without what a constant and a stiffness take up, of unit length."""
    basis = np.stack([np.ones_like(curve), HISTORY.deformation], axis=1)
    rest = curve - basis @ np.linalg.lstsq(basis, curve)[0]
    return rest / np.linalg.norm(rest)


def test_the_lists_share_no_name_and_are_long_enough():
    lists = (LISTED, CHOSEN, UNSEEN, LATE)
    assert len(MECHANISMS) == sum(map(len, lists))
    assert len(LISTED) == 7
    assert len(CHOSEN) >= 8
    assert len(UNSEEN) >= 10
    assert len(LATE) == 24


@pytest.mark.parametrize("name", MECHANISMS)
class TestEach:
    def test_says_what_happens(self, name):
        first = (MECHANISMS[name].__doc__ or "").partition("\n")[0]
        assert 10 < len(first) <= 80
        assert MECHANISMS[name].__name__ == name

    def test_is_finite_and_of_the_records_shape(self, name):
        for seed in SEEDS:
            curve = drawn(name, seed)
            assert curve.shape == HISTORY.order.shape, seed
            assert curve.dtype == float, seed
            assert np.all(np.isfinite(curve)), seed

    def test_is_about_a_newton_and_not_zero_on_a_rich_history(self, name):
        largest = [np.max(np.abs(drawn(name, seed))) for seed in range(30)]
        assert min(largest) > 0.1 and max(largest) < 15.0, largest

    def test_is_repeatable(self, name):
        np.testing.assert_array_equal(drawn(name, 3), drawn(name, 3))

    def test_differs_between_draws(self, name):
        draws = [drawn(name, seed) for seed in SEEDS]
        for one, other in itertools.combinations(draws, 2):
            assert not np.allclose(one, other)

    def test_survives_a_record_that_holds_everything_constant(self, name):
        poor = made_history(runs=1, cycles=1)
        flat = {"temperature": 20.0, "time": 0.0, "angle": 0.0, "direction": 0.0}
        held = {key: np.full(len(poor.order), value) for key, value in flat.items()}
        for seed in SEEDS:
            curve = drawn(name, seed, History(**vars(poor) | held))
            assert np.all(np.isfinite(curve)), seed


@pytest.mark.parametrize("seed", SEEDS)
def test_no_two_mechanisms_give_the_same_curve(seed):
    curves = {name: left_over(drawn(name, seed)) for name in MECHANISMS}
    alike = {
        (one, other): abs(curves[one] @ curves[other])
        for one, other in itertools.combinations(curves, 2)
    }
    assert {pair: value for pair, value in alike.items() if value >= 0.98} == {}


def test_the_likeness_sees_a_copy():
    burr = left_over(drawn("burr", 0))
    copy = left_over(3.0 - 2.0 * drawn("burr", 0) + 5.0 * HISTORY.deformation)
    assert abs(burr @ copy) > 0.999
