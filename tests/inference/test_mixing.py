"""Mixing and sensitivity are ArviZ' numbers, of all quantities in one pass."""

import arviz_stats
import numpy as np
import pytest
from arviz_base import from_dict
from arviz_stats.base.array import array_stats

from hdcal.inference.diagnostics import _sensitivity
from hdcal.inference.mixing import have_mixed, mixing
from hdcal.inference.pareto import pareto_shape


def chains(kind: str, shape: tuple[int, int], seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal(shape)
    if kind == "ties":
        return np.round(noise, 1)
    if kind == "apart":
        return noise + np.arange(shape[0])[:, None]
    if kind == "walk":
        return np.cumsum(noise, axis=1)
    memory = {"white": 0.0, "slow": 0.9, "alternating": -0.6}[kind]
    for step in range(1, shape[1]):
        noise[:, step] += memory * noise[:, step - 1]
    return noise


KINDS = ("white", "slow", "alternating", "ties", "apart", "walk")


@pytest.mark.parametrize(
    "shape", [(1, 500), (2, 5), (2, 20), (4, 8), (4, 51), (4, 1000)]
)
def test_numbers_are_those_of_arviz(shape: tuple[int, int]):
    draws = {kind: chains(kind, shape) for kind in KINDS}
    axes = {"chain_axis": 0, "draw_axis": 1}
    for kind, found in mixing(draws).items():
        values, many = draws[kind], shape[0] > 1
        wanted = (
            array_stats.rhat(values, **axes) if many else np.nan,
            array_stats.ess(values, **axes),
            array_stats.ess(values, method="tail", prob=0.89, **axes),
        )
        got = found.rhat, found.ess_bulk, found.ess_tail
        np.testing.assert_allclose(got, wanted, rtol=1e-9, err_msg=kind)


def test_who_asks_arviz_gets_the_same():
    draws = {kind: chains(kind, (4, 200)) for kind in KINDS}
    tree = from_dict({"posterior": draws})
    told = [arviz_stats.rhat(tree), arviz_stats.ess(tree)]
    told.append(arviz_stats.ess(tree, method="tail"))
    for kind, found in mixing(draws).items():
        wanted = [float(one[kind]) for one in told]
        got = [found.rhat, found.ess_bulk, found.ess_tail]
        np.testing.assert_allclose(got, wanted, rtol=1e-9, err_msg=kind)


def test_what_has_not_mixed_is_flagged():
    good = chains("white", (4, 1000))
    assert have_mixed({"good": good})
    for bad in (
        chains("apart", (4, 1000)),
        chains("walk", (4, 1000)),
        np.ones((4, 1000)),
        np.where(good > 3.0, np.nan, good),
        np.where(np.arange(4)[:, None] == 3, 3.0 * good, good),
        good[:, :3],
        good[:1],
    ):
        draws = {"good": good[: len(bad), : bad.shape[1]], "bad": bad}
        assert not have_mixed(draws)


def test_sensitivity_is_that_of_arviz():
    """Whose weights are smoothed besides, by some thousandths."""
    rng = np.random.default_rng(3)
    draws = {
        "moved": 1.0 + rng.standard_normal((4, 1000)),
        "wide": 8.0 * rng.standard_normal((4, 1000)),
        "skew": rng.gamma(2.0, 1.0, (4, 1000)),
    }
    part = -0.5 * draws["moved"] ** 2 - 0.1 * draws["skew"]
    tree = from_dict({"posterior": draws, "log_prior": {"prior": part}})
    wanted = arviz_stats.psense(tree, group="prior")
    found = dict(zip(draws, _sensitivity(draws, part), strict=True))
    for name, value in found.items():
        assert value == pytest.approx(float(wanted[name]), rel=0.02, abs=0.003)
    assert found["moved"] > 10.0 * found["wide"]


@pytest.mark.parametrize("count", [30, 200, 300, 4000])
@pytest.mark.parametrize("sd", [0.1, 1.0, 3.0])
def test_shape_of_a_tail_is_that_of_arviz(count: int, sd: float):
    weight = np.exp(sd * np.random.default_rng(count).standard_normal(count))
    wanted = array_stats.pareto_khat(weight[None], r_eff=1.0, tail="right").item()
    assert pareto_shape(weight) == pytest.approx(wanted, rel=1e-9)
    smoothed = float(array_stats.psislw(-np.log(weight))[1])
    assert pareto_shape(1e-9 * weight) == pytest.approx(smoothed, rel=1e-6)


def test_a_heavy_tail_is_told_from_a_light_one():
    rng = np.random.default_rng(1)
    assert pareto_shape(rng.uniform(0.5, 1.5, 4000)) < 0.2
    assert pareto_shape(1.0 / rng.uniform(size=4000)) > 0.8
    assert pareto_shape(np.where(np.arange(4000) < 100, 1.0, 0.0)) == np.inf
    with pytest.raises(ValueError, match="all the same"):
        pareto_shape(np.ones(4000))
    with pytest.raises(ValueError, match="no tail"):
        pareto_shape(np.arange(8.0))
