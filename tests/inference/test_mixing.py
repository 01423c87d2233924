"""Chains that have not mixed and heavy tails of weights are flagged."""

import arviz_stats
import numpy as np
import pytest
from arviz_base import from_dict

from hdcal.inference.diagnostics import (
    have_mixed,
    mixing,
    pareto_shape,
    power_sensitivity,
)


def chains(shape: tuple[int, int] = (4, 1000)) -> np.ndarray:
    return np.random.default_rng(0).standard_normal(shape)


def test_arviz_gives_the_same_numbers():
    draws = {"K": chains((4, 200))}
    tree = from_dict({"posterior": draws})
    tail = arviz_stats.ess(tree, method="tail")
    wanted = arviz_stats.rhat(tree), arviz_stats.ess(tree), tail
    found = mixing(draws)["K"]
    got = found.rhat, found.ess_bulk, found.ess_tail
    assert got == pytest.approx([float(one["K"]) for one in wanted])


def test_what_has_not_mixed_is_flagged():
    good = chains()
    assert have_mixed({"good": good})
    for bad in (
        good + np.arange(4)[:, None],
        np.cumsum(good, axis=1),
        np.ones((4, 1000)),
        np.where(good > 3.0, np.nan, good),
        np.where(np.arange(4)[:, None] == 3, 3.0 * good, good),
        good[:, :3],
        good[:1],
    ):
        draws = {"good": good[: len(bad), : bad.shape[1]], "bad": bad}
        assert not have_mixed(draws)


def test_sensitivity_is_that_of_arviz():
    """ArviZ smooths the weights besides, by some thousandths."""
    rng = np.random.default_rng(3)
    draws = {
        "moved": 1.0 + rng.standard_normal((4, 1000)),
        "wide": 8.0 * rng.standard_normal((4, 1000)),
    }
    part = -0.5 * draws["moved"] ** 2
    tree = from_dict({"posterior": draws, "log_prior": {"prior": part}})
    wanted = arviz_stats.psense(tree, group="prior")
    for name, value in power_sensitivity(draws, part).items():
        assert value == pytest.approx(float(wanted[name]), rel=0.02, abs=0.003)


def test_a_heavy_tail_is_told_from_a_light_one():
    rng = np.random.default_rng(1)
    assert pareto_shape(rng.uniform(0.5, 1.5, 4000)) < 0.2
    assert pareto_shape(1.0 / rng.uniform(size=4000)) > 0.8
    assert pareto_shape(np.where(np.arange(4000) < 100, 1.0, 0.0)) == np.inf
    with pytest.raises(ValueError):
        pareto_shape(np.ones(4000))
