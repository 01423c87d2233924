"""Gears that are integrated out leave the likelihood of the whole covariance matrix."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import optimize
from scipy.stats import multivariate_normal

from hdcal.fleets.gear_sums import MountingSums, gear_sums
from hdcal.fleets.population_problem import (
    PopulationProblem,
    draw_gears,
    gear_law,
)
from hdcal.inference.likelihood import log_likelihood

# Nats by which four nodes may differ from a fine grid.
_CLOSE = 0.02

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


def sums_of(mountings, operators=None, rigs=None):
    """Return the sums of (gear, x, y) for each mounting."""
    rows = []
    for gear, x, y in mountings:
        about_x, about_y = x - x.mean(), y - y.mean()
        products = about_x @ about_x, about_x @ about_y, about_y @ about_y
        rows.append((gear, len(x), x.mean(), y.mean(), *products))
    columns = np.array(rows).T
    nobody = np.zeros(len(rows), int)
    by = (nobody if told is None else np.array(told) for told in (operators, rigs))
    return MountingSums(columns[0].astype(int), *columns[1:], *by)


def problem_of(mountings, gears, lots=None, operators=None, rigs=None):
    lot = np.zeros(gears, int) if lots is None else np.array(lots)
    return PopulationProblem({}, gear_sums(sums_of(mountings, operators, rigs), lot))


VALUES = {
    "stiffness": 200.0,
    "specimen_sd": 0.03,
    "zero": 0.4,
    "run_offset_sd": 0.8,
    "sigma": 0.5,
    "noise_spread": 0.0,
    "off_share": 0.07,
    "off_ratio": 5.0,
}


def fleet(seed=0, gears=3):
    rng = np.random.default_rng(seed)
    found = []
    for gear in range(gears):
        # Some mountings of a gear have equally many rows, some have not.
        for mounting in range(1 + gear):
            x = rng.uniform(0.0, 0.5, 6 + gear + mounting // 2)
            stiffness = 200.0 * (1.0 + 0.03 * rng.standard_normal())
            y = stiffness * x + rng.normal() + 0.5 * rng.standard_normal(len(x))
            found.append((gear, x, y))
    return found


def dense(mountings, values, lot=0.0, operators=None, rigs=None):
    """Return log p and the mean stiffness of one gear, for both kinds of gears.

    Args:
        mountings: of it.
        values: of the population.
        lot: by which share its lot is stiffer.
        operators: by how much the zero of each mounting's operator is higher [N].
        rigs: by which share the rig of each mounting reads more.
    """
    gains = np.zeros(len(mountings)) if rigs is None else np.array(rigs)
    read = zip(gains, mountings, strict=True)
    x = np.concatenate([(1.0 + gain) * x for gain, (_, x, _) in read])
    y = np.concatenate([y for _, _, y in mountings])
    run = np.repeat(np.arange(len(mountings)), [len(x) for _, x, _ in mountings])
    noise = values["sigma"] ** 2 * np.eye(len(x))
    noise += values["run_offset_sd"] ** 2 * (run[:, None] == run)
    centre = values["stiffness"] * (1.0 + lot)
    by = np.zeros(len(mountings)) if operators is None else np.array(operators)
    mean = centre * x + values["zero"] + by[run]
    found = []
    for wide in (1.0, np.sqrt(1.0 + values["off_ratio"] ** 2)):
        between = (values["specimen_sd"] * centre * wide) ** 2
        whole = noise + between * np.outer(x, x)
        gain = between * x @ np.linalg.solve(whole, y - mean)
        law = multivariate_normal(mean, whole)
        found.append((law.logpdf(y), centre + gain))
    return np.array(found)


@pytest.mark.parametrize("groups", [False, True])
def test_the_likelihood_is_that_of_all_rows_with_their_covariance(groups):
    mountings = fleet()
    lots, operators, rigs = np.zeros(3, int), np.zeros(6, int), np.zeros(6, int)
    values = dict(VALUES)
    if groups:
        lots, operators = np.array([0, 1, 1]), np.array([0, 1, 0, 1, 1, 0])
        # One gear is read on one rig only, the others on several.
        rigs = np.array([2, 0, 1, 1, 1, 0])
        values |= {"rig_1": 0.03, "rig_2": -0.05, "rig_3": 0.02, "rig_sd": 0.02}
        values |= {"lot_1": 0.02, "lot_2": -0.02, "lot_sd": 0.01}
        values |= {"operator_1": 0.7, "operator_2": -0.7, "operator_sd": 1.0}
    of_lot = np.array([values.get("lot_1", 0.0), values.get("lot_2", 0.0)])
    by = np.array([values.get("operator_1", 0.0), values.get("operator_2", 0.0)])
    gains = np.array([values.get(f"rig_{k}", 0.0) for k in (1, 2, 3)])
    shares = np.log([1.0 - VALUES["off_share"], VALUES["off_share"]])
    expected, means, chances = 0.0, [], []
    for gear in range(3):
        here = np.array([m[0] == gear for m in mountings])
        own = [m for m, inside in zip(mountings, here, strict=True) if inside]
        beside = by[operators[here]], gains[rigs[here]]
        logs, mean = dense(own, values, of_lot[lots[gear]], *beside).T
        whole = np.logaddexp.reduce(logs + shares)
        # The sums leave out what does not depend on the parameters.
        rows = [len(x) for one, x, _ in mountings if one == gear]
        expected += whole + 0.5 * sum(n * np.log(2.0 * np.pi) + np.log(n) for n in rows)
        means.append(mean)
        chances.append(np.exp(logs + shares - whole))
    problem = problem_of(mountings, 3, lots, operators, rigs)
    assert log_likelihood(problem, values) == pytest.approx(expected, abs=1e-9)
    law = gear_law(problem, values)
    np.testing.assert_allclose(law.mean[:, 0], means, rtol=1e-10)
    np.testing.assert_allclose(np.exp(law.log_weight).sum(axis=1), chances, rtol=1e-8)


LIKELIHOOD = jax.jit(log_likelihood)
EACH = jax.jit(jax.vmap(log_likelihood, (None, {**dict.fromkeys(VALUES), "sigma": 0})))


@pytest.mark.parametrize("rows", [3, 6, 20, 200, 2000])
@pytest.mark.parametrize("spread", [0.02, 0.1, 0.3, 0.8])
@pytest.mark.parametrize("off", [-1.5, 0.0, 1.5])
def test_noise_that_differs_is_integrated(rows, spread, off):
    """Four nodes against a fine grid of the log-normal noise.

    Of many readings a rule with nodes about the noise of all is wrong by whole nats.
    """
    rng = np.random.default_rng(rows)
    x, noise = rng.uniform(0.0, 0.5, rows), 0.5 * np.exp(off * spread)
    problem = problem_of([(0, x, 200.0 * x + noise * rng.standard_normal(rows))], 1)
    place = np.linspace(-7.0, 7.0, 4001)
    weight = np.exp(-0.5 * place**2) / np.exp(-0.5 * place**2).sum()
    sigma = 0.5 * jnp.exp(spread * place)
    fine = np.asarray(EACH(problem, {**VALUES, "sigma": sigma}))
    expected = np.logaddexp.reduce(np.log(weight) + fine)
    found = LIKELIHOOD(problem, {**VALUES, "noise_spread": spread})
    assert float(found) == pytest.approx(expected, abs=_CLOSE)


def test_noise_is_integrated_where_it_is_at_the_gain_of_a_rig():
    """Beside its lines on two rigs a gear scatters by less than beside one line.

    Nodes where lines on each rig have the noise would miss nearly all there is.
    """
    rng = np.random.default_rng(8)
    x = np.linspace(0.0, 0.5, 20)
    noise = (0.2 * rng.standard_normal(20) for _ in range(2))
    read = [(0, x, s * x + e) for s, e in zip((200.0, 206.0), noise, strict=True)]
    gains = {"rig_1": 0.0, "rig_2": 0.0, "rig_sd": 0.02, "noise_spread": 0.3}
    two = problem_of(read, 1, rigs=[0, 1])
    one = float(log_likelihood(problem_of(read, 1), VALUES | {"noise_spread": 0.3}))
    assert float(log_likelihood(two, VALUES | gains)) == pytest.approx(one, abs=1e-9)


def test_draws_of_gears_follow_their_law():
    problem = problem_of(fleet(seed=4), 3)
    many = {name: np.full(4000, value) for name, value in VALUES.items()}
    drawn = draw_gears(problem, many, seed=1)
    law = gear_law(problem, VALUES)
    mean = np.sum(np.exp(law.log_weight) * law.mean, axis=(1, 2))
    error = np.std(np.asarray(drawn.stiffness), axis=0) / np.sqrt(4000)
    apart = (np.mean(np.asarray(drawn.stiffness), axis=0) - mean) / error
    assert np.all(np.abs(apart) < 4.0)
    off = np.exp(law.log_weight)[..., 1].sum(axis=1)
    np.testing.assert_allclose(np.asarray(drawn.off)[0], off, rtol=1e-10)


def reml(layout):
    """Return both sds that maximise the likelihood with the centre integrated out."""
    ones = [(g, np.ones(len(row)), np.array(row)) for g, row in enumerate(layout)]
    centre, spread = np.mean(layout), np.std(layout)
    problem = problem_of(ones, len(layout))
    places = centre + spread * np.linspace(-5.0, 5.0, 401)
    usual = {**VALUES, "zero": 0.0, "run_offset_sd": 0.0, "off_share": 0.0}

    @jax.jit
    def lost(logs):
        between, within = jnp.exp(logs)

        def at(place):
            values = {"stiffness": place, "specimen_sd": between / place}
            return log_likelihood(problem, {**usual, **values, "sigma": within})

        return -jax.nn.logsumexp(jax.vmap(at)(places))

    begin = np.log([spread / 2.0, spread])
    options = {"xatol": 1e-7, "fatol": 1e-10}
    found = optimize.minimize(lost, begin, method="Nelder-Mead", options=options)
    return np.exp(found.x)


def test_dyestuff_is_what_others_find():
    np.testing.assert_allclose(reml(DYESTUFF), (42.00, 49.51), rtol=1e-3)


def test_silicon_is_as_certified():
    layout = np.array(SILICON)
    means = layout.mean(axis=1, keepdims=True)
    assert np.sum((layout - means) ** 2) == pytest.approx(WITHIN, rel=1e-8)
    assert 5.0 * np.sum((means - means.mean()) ** 2) == pytest.approx(BETWEEN, rel=1e-8)
    between = (BETWEEN / 4.0 - WITHIN / 20.0) / 5.0
    expected = np.sqrt([between, WITHIN / 20.0])
    np.testing.assert_allclose(reml(SILICON), expected, rtol=2e-3)


@pytest.mark.parametrize("spread", [0.05, 0.3])
def test_the_gradient_is_near_that_of_the_density(spread):
    """It leaves out how nodes move, which the integral hardly depends on."""
    problem = problem_of(fleet(seed=6, gears=8), 8)
    values = {name: jnp.asarray(value) for name, value in VALUES.items()}
    values["noise_spread"] = jnp.asarray(spread)
    height = jax.jit(lambda at: log_likelihood(problem, at))
    slope = jax.jit(jax.grad(lambda at: log_likelihood(problem, at)))(values)
    for name, at in values.items():
        step = 1e-4 * float(abs(at))
        ends = [
            float(height({**values, name: at + side * step})) for side in (1.0, -1.0)
        ]
        # In steps of a tenth of the parameter, of which a nat is a standard error.
        expected = 0.1 * float(abs(at)) * (ends[0] - ends[1]) / (2.0 * step)
        found = 0.1 * float(abs(at)) * float(slope[name])
        assert found == pytest.approx(expected, rel=0.05, abs=0.1), name
