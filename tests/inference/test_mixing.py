"""Chains that have not mixed and heavy tails of weights are flagged."""

import arviz_stats
import numpy as np
import pytest
from arviz_base import from_dict

from hdcal.inference.diagnostics import have_mixed, mixing, pareto_shape

GOOD = np.random.default_rng(0).standard_normal((4, 1000))


def test_arviz_gives_the_same_numbers():
    draws = {"K": GOOD[:, :200]}
    tree = from_dict({"posterior": draws})
    tail = arviz_stats.ess(tree, method="tail")
    wanted = arviz_stats.rhat(tree), arviz_stats.ess(tree), tail
    found = mixing(draws)["K"]
    numbers = found.rhat, found.ess_bulk, found.ess_tail
    assert numbers == pytest.approx([float(one["K"]) for one in wanted])


@pytest.mark.parametrize(
    "bad",
    [
        GOOD + np.arange(4)[:, None],
        np.cumsum(GOOD, axis=1),
        np.ones((4, 1000)),
        np.where(GOOD > 3.0, np.nan, GOOD),
        np.where(np.arange(4)[:, None] == 3, 3.0 * GOOD, GOOD),
        GOOD[:, :3],
        GOOD[:1],
    ],
)
def test_what_has_not_mixed_is_flagged(bad):
    assert have_mixed({"good": GOOD})
    assert not have_mixed({"good": GOOD[: len(bad), : bad.shape[1]], "bad": bad})


@pytest.mark.parametrize("shape", [0.3, 0.5, 0.9])
def test_the_tail_of_weights_has_its_pareto_shape(shape: float):
    rng = np.random.default_rng(4)
    weight = np.random.default_rng(4).pareto(1.0 / shape, 100_000) + 1.0
    assert pareto_shape(weight) == pytest.approx(shape, abs=0.1)
    few = np.where(np.arange(100_000) < 50, rng.random(100_000), 0.0)
    assert pareto_shape(few) == np.inf
