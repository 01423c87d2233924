"""Gears that are integrated out leave the density of the whole covariance matrix."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import optimize
from scipy.stats import multivariate_normal

from hdcal.fleets.model.gear_noise import GearNoise
from hdcal.fleets.model.gear_quantity import (
    GearQuantity,
    NoiseNodes,
    draw_gears,
    gear_posterior,
)

# One-way layouts. Davies, Statistical Methods in Research and Production (1947): yields
# of dyestuff from six batches; lme4 gives the sds 42.0 and 49.5 by REML. NIST StRD:
# SiRstv, resistivity of silicon by five instruments, with certified sums of squares.
DYESTUFF = [
    (1545.0, 1440.0, 1440.0, 1520.0, 1580.0),
    (1540.0, 1555.0, 1490.0, 1560.0, 1495.0),
    (1595.0, 1550.0, 1605.0, 1510.0, 1560.0),
    (1445.0, 1440.0, 1595.0, 1465.0, 1545.0),
    (1595.0, 1630.0, 1515.0, 1635.0, 1625.0),
    (1520.0, 1455.0, 1450.0, 1480.0, 1445.0),
]
SILICON = [
    (196.3052, 196.1240, 196.1890, 196.2569, 196.3403),
    (196.3042, 196.3825, 196.1669, 196.3257, 196.0422),
    (196.1303, 196.2005, 196.2889, 196.0343, 196.1811),
    (196.2795, 196.1748, 196.1494, 196.1485, 195.9885),
    (196.2119, 196.1051, 196.1850, 196.0052, 196.2090),
]
# Certified sums of squares between and within, 4 and 20 degrees of freedom.
BETWEEN, WITHIN = 5.11462616e-2, 2.16636560e-1

VALUES = {"centre": 200.0, "spread": 0.03, "off_share": 0.07, "off_ratio": 5.0}
GROUPS = {
    "lot_1": 0.02,
    "lot_2": -0.02,
    "rig_1": 0.03,
    "rig_2": -0.03,
    "operator_1": 0.7,
    "operator_2": -0.7,
}
GEARS, ROWS = 4, 3


def quantity(**given) -> GearQuantity:
    """Return gears of one lot, rig and operator that scatter, but for what is given."""
    shape = given["value"].shape
    none = {"shared": np.zeros(shape[0]), "lot": np.zeros(shape[0], int)}
    none |= dict.fromkeys(("rig", "operator"), np.zeros(shape, int))
    none |= {"present": np.ones(shape), "priors": {}, "groups": {}}
    none |= {"relative": np.asarray(0.0), "by_row": np.asarray(0.0)}
    return GearQuantity(**none | given)


def problem(seed: int = 0, *, relative: float, by_row: float) -> GearQuantity:
    """Return gears with up to three rows each and one noise node."""
    rng = np.random.default_rng(seed)
    shape = GEARS, ROWS
    present = np.ones(shape)
    present[0, 1:] = present[2, 2] = 0.0
    return quantity(
        value=200.0 + 5.0 * rng.standard_normal(shape),
        error=rng.uniform(0.5, 4.0, shape),
        present=present,
        rig=rng.integers(0, 2, shape),
        operator=rng.integers(0, 2, shape),
        shared=1e-4 * relative + rng.uniform(0.0, 1e-4 if relative else 2.0, GEARS),
        lot=np.array([0, 1, 1, 0]),
        noise=NoiseNodes(rng.uniform(0.5, 2.0, (GEARS, 1)), jnp.zeros(1)),
        relative=np.asarray(relative),
        by_row=np.asarray(by_row),
    )


def dense(one: GearQuantity, gear: int, values: dict) -> np.ndarray:
    """Return log density and mean of θ of a gear, for both kinds of gears."""
    own = np.asarray(one.present)[gear] > 0.0
    lot = (values["lot_1"], values["lot_2"])[one.lot[gear]]
    rig = np.array([values["rig_1"], values["rig_2"]])[one.rig[gear, own]]
    operator = np.array([values["operator_1"], values["operator_2"]])
    centre = values["centre"] * (1.0 + lot) * (1.0 + rig)
    mean = centre + operator[one.operator[gear, own]]
    load = mean if one.relative else np.ones_like(mean)
    noise, scatter = float(one.noise.sd[gear, 0]) ** 2, values["spread"] ** 2
    rows = np.diag(one.by_row * scatter + one.error[gear, own] * noise)
    rows = rows + one.shared[gear] * noise * np.outer(load, load)
    found = []
    for odd in (0.0, values["off_ratio"] ** 2):
        between = scatter * (1.0 - float(one.by_row) + odd)
        whole = rows + between * np.outer(load, load)
        rest = one.value[gear, own] - mean
        gain = between * load @ np.linalg.solve(whole, rest)
        spread = between - between**2 * load @ np.linalg.solve(whole, load)
        density = multivariate_normal(mean, whole).logpdf(one.value[gear, own])
        found.append((density + 0.5 * len(mean) * np.log(2.0 * np.pi), gain, spread))
    return np.array(found).T


@pytest.mark.parametrize(("relative", "by_row"), [(1.0, 0.0), (0.0, 1.0), (0.0, 0.0)])
def test_density_and_gears_are_those_of_the_whole_covariance(relative, by_row):
    one = problem(relative=relative, by_row=by_row)
    values = VALUES | GROUPS | ({} if relative else {"spread": 4.0})
    share = np.log([1.0 - values["off_share"], values["off_share"]])
    each = [dense(one, gear, values) for gear in range(GEARS)]
    expected = sum(np.logaddexp.reduce(log + share) for log, _, _ in each)
    assert float(one.log_likelihood(values)) == pytest.approx(expected, abs=1e-9)
    found = gear_posterior(one, values)
    for gear, (log, mean, variance) in enumerate(each):
        np.testing.assert_allclose(found.log_joint[gear, 0], log + share, rtol=1e-10)
        np.testing.assert_allclose(found.mean[gear, 0], mean, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(
            found.sd[gear, 0] ** 2, variance, rtol=1e-7, atol=1e-12
        )


def test_draws_of_gears_follow_their_density():
    one = problem(seed=4, relative=1.0, by_row=0.0)
    many = {name: np.full(4000, value) for name, value in (VALUES | GROUPS).items()}
    drawn = draw_gears(one, many, 1)
    found = gear_posterior(one, VALUES | GROUPS)
    weight = jax.nn.softmax(found.log_joint.reshape(GEARS, -1), axis=1)
    mean = np.sum(weight * found.mean.reshape(GEARS, -1), axis=1)
    error = np.std(np.asarray(drawn.apart), axis=0) / np.sqrt(4000)
    assert np.all(np.abs(np.mean(drawn.apart, axis=0) - mean) < 4.0 * error)
    np.testing.assert_allclose(drawn.off[0], weight[:, 1], rtol=1e-9)


@pytest.mark.parametrize("freedom", [1.0, 20.0, 2000.0])
@pytest.mark.parametrize("spread", [0.02, 0.3, 0.8])
@pytest.mark.parametrize("away", [-1.5, 1.5])
def test_the_noise_of_a_gear_is_integrated(freedom, spread, away):
    """Four nodes for each kind against a fine grid."""
    one = GearNoise({}, np.array([freedom]), np.log([0.5]) + away * spread)
    values = VALUES | {"centre": 0.5, "spread": spread}
    place = np.linspace(-9.0, 9.0, 8001)
    expected = []
    for wide, share in ((1.0, 0.93), (np.sqrt(26.0), 0.07)):
        log_sd = wide * spread * place - away * spread
        density = -freedom * (log_sd + 0.5 * np.exp(-2.0 * log_sd)) - 0.5 * place**2
        expected.append(np.logaddexp.reduce(density) + np.log(share))
    expected = np.logaddexp.reduce(expected)
    expected -= np.log(np.sum(np.exp(-0.5 * place**2)))
    # Very wide kinds of a gear with hardly any readings are rough, and rare.
    close = 0.02 if spread < 0.5 or freedom > 1.0 else 0.1
    assert float(one.log_likelihood(values)) == pytest.approx(expected, abs=close)


def reml(layout) -> float:
    """Return the sd between groups that maximises the density over the centre."""
    rows = np.array(layout)
    within = np.var(rows, axis=1, ddof=1).mean()
    gears, count = rows.shape
    one = quantity(
        value=rows.mean(axis=1)[:, None],
        error=np.full((gears, 1), 1.0 / count),
        noise=NoiseNodes(np.full((gears, 1), np.sqrt(within)), jnp.zeros(1)),
    )
    places = rows.mean() + rows.std() * np.linspace(-5.0, 5.0, 801)

    @jax.jit
    def lost(log_sd):
        def at(place):
            usual = {"off_share": 0.0, "off_ratio": 1.0, "centre": place}
            return one.log_likelihood(usual | {"spread": jnp.exp(log_sd)})

        return -jax.nn.logsumexp(jax.vmap(at)(places))

    ends = np.log(rows.std()) + np.array([-6.0, 2.0])
    found = optimize.minimize_scalar(lost, bounds=ends, method="bounded")
    return float(np.exp(found.x))


def test_layouts_agree_with_lme4_and_the_certificate():
    assert reml(DYESTUFF) == pytest.approx(42.00, rel=1e-3)
    expected = np.sqrt((BETWEEN / 4.0 - WITHIN / 20.0) / 5.0)
    assert reml(SILICON) == pytest.approx(expected, rel=2e-3)
