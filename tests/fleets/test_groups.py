"""Starting values of groups: medians of members, and gains of rigs."""

import numpy as np
import pytest

from hdcal.fleets.model.groups import distinguished, gains_of_rigs, medians_of_groups

GAINS = np.array([0.02, -0.005, -0.015])


def test_gears_on_several_rigs_compare_them_whatever_their_stiffness():
    """Gear by gear on two rigs of three, whose gains sum to zero."""
    gear = np.repeat(np.arange(6), 2)
    rig = np.array([0, 1, 1, 2, 0, 2] * 2)
    own = np.linspace(-0.1, 0.1, 6)[gear]
    found = gains_of_rigs(own + GAINS[rig], np.full(12, 1e-8), gear, rig)
    assert found.offsets == pytest.approx(GAINS, abs=1e-4)
    assert np.all(np.sqrt(found.variance) < 1e-3)


def test_without_a_common_gear_rigs_are_compared_through_the_scatter_of_gears():
    rng = np.random.default_rng(2)
    gear, rig = np.arange(60), np.repeat([0, 1, 2], 20)
    value = rng.normal(0.0, 0.01, 60) + GAINS[rig]
    found = gains_of_rigs(value, np.full(60, 1e-8), gear, rig)
    assert found.offsets == pytest.approx(GAINS, abs=0.007)
    # 0.01 / √20 each; contrasts of means of equal weight keep it.
    assert np.sqrt(found.variance) == pytest.approx(np.full(2, 0.0022), rel=0.4)


def test_medians_of_groups_are_not_moved_by_an_outlier():
    rng = np.random.default_rng(3)
    group = np.repeat([0, 1, 2], 21)
    values = 200.0 * (1.0 + GAINS[group]) + rng.normal(0.0, 0.1, 63)
    values[5] = 1e4
    found = medians_of_groups(values, group)
    assert found.offsets == pytest.approx(200.0 * GAINS, abs=0.1)
    assert np.sqrt(found.variance) == pytest.approx(np.full(2, 0.022), rel=0.5)


def test_groups_are_distinguished_where_they_are_several_and_not_one_each():
    assert distinguished(["b", "a", "b"])[0] == ["a", "b"]
    assert distinguished(["b", "a", "b"])[1].tolist() == [1, 0, 1]
    for labels in (["a"] * 3, list("abc"), [str(k // 2) for k in range(84)]):
        names, index = distinguished(labels)
        assert not names and not index.any()
