"""The budget gives the printed numbers of the GUM's and JCGM 101's own examples."""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from propagation import monte_carlo

from hdcal.prediction.budget.inputs import joined_inputs, limited_input, one_input
from hdcal.prediction.budget.linear import (
    check_linear,
    coverage_factor,
    linear_budget,
    numerical_tolerance,
)

TRIALS = 1_000_000


@pytest.fixture(scope="module", autouse=True)
def double_precision() -> Iterator[None]:
    before = jax.config.read("jax_enable_x64")
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


def end_gauge(x):
    """JCGM 100:2008, (H.3); lengths in nm."""
    standard, difference, expansion, theta, excess, warmer = x
    warmth = excess * theta + expansion * warmer
    return standard + difference - standard * warmth


def test_the_end_gauge_of_h1():
    """JCGM 100:2008, H.1.2 to H.1.6 and Table H.1."""
    found = linear_budget(
        end_gauge,
        [
            one_input("l_S", 50_000_623.0, 25.0, 18),
            one_input("d", 215.0, 9.7, 25.6),
            limited_input("alpha_S", 9.5e-6, 13.5e-6),
            one_input("theta", -0.1, 0.41),
            limited_input("delta alpha", -1e-6, 1e-6, dof=50),
            limited_input("delta theta", -0.05, 0.05, dof=2),
        ],
    )
    assert round(found.estimate) == 50_000_838
    brought = found.sensitivities * found.standard_uncertainties
    assert np.round(np.abs(brought), 1).tolist() == [25.0, 9.7, 0.0, 0.0, 2.9, 16.6]
    assert round(found.standard_uncertainty) == 32
    assert int(found.dof) == 16
    assert round(coverage_factor(16, 0.99), 2) == 2.92
    assert found.shares.sum() == pytest.approx(1.0, abs=1e-12)


def impedance(x, quantity: str):
    """JCGM 100:2008, (H.7): R, X and Z from V, I and φ."""
    ratio = x[0] / x[1]
    of = {"R": jnp.cos(x[2]), "X": jnp.sin(x[2]), "Z": 1.0}
    return ratio * of[quantity]


READ = np.array(
    [
        [5.007, 4.994, 5.005, 4.990, 4.999],
        [19.663e-3, 19.639e-3, 19.640e-3, 19.685e-3, 19.678e-3],
        [1.0456, 1.0438, 1.0468, 1.0428, 1.0433],
    ]
)
# JCGM 100:2008, Tables H.3 and H.4: value and uncertainty, correlations.
PRINTED = {"R": (127.732, 0.071), "X": (219.847, 0.295), "Z": (254.260, 0.236)}
TIED = {"RX": -0.588, "RZ": -0.485, "XZ": 0.993}


def test_resistance_and_reactance_of_h2():
    together = joined_inputs(("V", "I", "phi"), READ.mean(axis=1), np.cov(READ) / 5)
    found = {
        name: linear_budget(lambda x, name=name: impedance(x, name), [together])
        for name in PRINTED
    }
    for name, (value, uncertainty) in PRINTED.items():
        assert round(found[name].estimate, 3) == value
        # Of X the GUM prints 0.295, which is 0.29558 cut off.
        assert found[name].standard_uncertainty == pytest.approx(uncertainty, abs=6e-4)
        assert found[name].shares.sum() == pytest.approx(1.0, abs=1e-12)
    for pair, printed in TIED.items():
        one, other = (found[name] for name in pair)
        both = one.sensitivities @ together.covariance @ other.sensitivities
        tied = both / one.standard_uncertainty / other.standard_uncertainty
        assert round(tied, 3) == printed


def test_a_budget_that_ignores_the_covariance_of_h2_is_wrong():
    """The wrong twin: the same readings as if they were independent."""
    sds = READ.std(axis=1, ddof=1) / np.sqrt(5)
    apart = [
        one_input(*each) for each in zip("VIφ", READ.mean(axis=1), sds, strict=True)
    ]
    for name, (_, uncertainty) in PRINTED.items():
        found = linear_budget(lambda x, name=name: impedance(x, name), apart)
        assert abs(found.standard_uncertainty / uncertainty - 1.0) > 0.1


def both(model, inputs, coverage=0.95, shortest=False):
    """Return linear budget, Monte Carlo, their intervals and the check."""
    linear, drawn = linear_budget(model, inputs), monte_carlo(model, inputs, TRIALS)
    ends = drawn.shortest(coverage) if shortest else drawn.interval(coverage)
    about = linear.interval(coverage)
    return linear, drawn, ends, check_linear(about, ends, linear.standard_uncertainty)


def within(sd: float):
    """Return an input that is rectangular about 0 with an sd."""
    return limited_input("x", -np.sqrt(3.0) * sd, np.sqrt(3.0) * sd)


# JCGM 101:2008, Tables 2, 3 and 4: u and half the 95 % interval by both; whether the
# linear budget stands.
ADDED = {
    "normal, 9.2.2": ([one_input("x", 0.0, 1.0)] * 4, 2.00, 3.92, 3.92, True),
    "rectangular, 9.2.3": ([within(1.0)] * 4, 2.00, 3.92, 3.88, True),
    "unequal, 9.2.4": ([within(1.0)] * 3 + [within(10.0)], 10.1, 19.9, 17.0, False),
}


@pytest.mark.parametrize("name", ADDED)
def test_the_additive_model_of_9_2(name: str):
    inputs, sd, linear_half, drawn_half, stands = ADDED[name]
    linear, drawn, ends, check = both(jnp.sum, inputs)
    digits = 2 if sd < 10.0 else 1
    assert round(linear.standard_uncertainty, digits) == sd
    exact = linear.standard_uncertainty
    assert drawn.standard_uncertainty == pytest.approx(exact, rel=2e-3)
    assert round(linear.interval()[1], digits) == linear_half
    # A million trials leave an sd of 0.0027 u in an end of the interval.
    assert np.abs(ends) == pytest.approx(drawn_half, abs=0.008 * sd + 0.05 * (sd > 9))
    assert check.valid is stands


def mass(x):
    """JCGM 101:2008, (33): deviation of the conventional mass from 100 g [mg]."""
    reference, added, air, weight, standard = x
    buoyancy = (air - 1.2) * (1.0 / weight - 1.0 / standard)
    return (reference + added) * (1.0 + buoyancy) - 100_000.0


def test_the_mass_calibration_of_9_3():
    """JCGM 101:2008, Tables 5 and 6: shortest 95 % intervals."""
    inputs = [
        one_input("m_R,c", 100_000.0, 0.050),
        one_input("delta m_R,c", 1.234, 0.020),
        limited_input("rho_a", 1.10, 1.30),
        limited_input("rho_W", 7_000.0, 9_000.0),
        limited_input("rho_R", 7_950.0, 8_050.0),
    ]
    linear, drawn, ends, check = both(mass, inputs, shortest=True)
    assert round(linear.estimate, 4) == 1.2340
    assert round(linear.standard_uncertainty, 4) == 0.0539
    assert np.round(linear.interval(), 4).tolist() == [1.1285, 1.3395]
    # The printed values are those of another run of so many trials.
    assert drawn.estimate == pytest.approx(1.2341, abs=3e-4)
    assert drawn.standard_uncertainty == pytest.approx(0.0754, abs=2e-4)
    assert ends == pytest.approx((1.0834, 1.3825), abs=3e-3)
    assert check.tolerance == 0.0005 and not check.valid


def squared_sum(x):
    """JCGM 101:2008, (36): power lost by mismatch."""
    return x[0] ** 2 + x[1] ** 2


# JCGM 101:2008, Tables 8 and 9 in 1e-6: correlation, x₁; linear u and 95 % interval;
# mean, u and shortest 95 % interval by Monte Carlo.
MISMATCH = [
    (0.0, 0.000, 0, (0, 0), 50, 50, (0, 150)),
    (0.0, 0.010, 100, (-96, 296), 150, 112, (0, 367)),
    (0.0, 0.050, 500, (1520, 3480), 2551, 502, (1590, 3543)),
    (0.9, 0.000, 0, (0, 0), 50, 67, (0, 185)),
    (0.9, 0.010, 100, (-96, 296), 150, 121, (13, 398)),
    (0.9, 0.050, 500, (1520, 3480), 2551, 505, (1628, 3555)),
]


@pytest.mark.parametrize("row", MISMATCH)
def test_the_comparison_loss_of_9_4(row):
    tied, x1, sd, straight, mean, drawn_sd, shortest = row
    variance = 0.005**2 * np.array([[1.0, tied], [tied, 1.0]])
    inputs = [joined_inputs(("x1", "x2"), [x1, 0.0], variance)]
    linear, drawn, ends, check = both(squared_sum, inputs, shortest=True)
    assert round(1e6 * linear.standard_uncertainty) == sd
    assert tuple(np.round(1e6 * np.array(linear.interval()))) == straight
    assert 1e6 * drawn.estimate == pytest.approx(mean, abs=1.5)
    assert 1e6 * drawn.standard_uncertainty == pytest.approx(drawn_sd, abs=1.2)
    # The shortest interval is flat at its best: its ends are known to few digits.
    assert 1e6 * np.array(ends) == pytest.approx(shortest, abs=0.03 * drawn_sd + 1.0)
    assert not check.valid


def gauge_block(x):
    """JCGM 101:2008, (38): deviation from the nominal 50 mm [nm]."""
    standard, mean, random, systematic, expansion, theta, cycle, excess, warmer = x
    difference = mean + random + systematic
    warmth = excess * (theta + cycle) + expansion * warmer
    return standard + difference - standard * warmth - 50_000_000.0


def test_the_gauge_block_of_9_5():
    """JCGM 101:2008, Tables 10 and 11: 99 % intervals."""
    inputs = [
        one_input("L_S", 50_000_623.0, 25.0, 18),
        one_input("D", 215.0, 6.0, 24),
        one_input("d1", 0.0, 4.0, 5),
        one_input("d2", 0.0, 7.0, 8),
        limited_input("alpha_S", 9.5e-6, 13.5e-6),
        one_input("theta_0", -0.1, 0.2),
        limited_input("Delta", -0.5, 0.5, "arcsine"),
        limited_input("delta alpha", -1e-6, 1e-6, dof=50),
        limited_input("delta theta", -0.05, 0.05, dof=2),
    ]
    linear, drawn, ends, check = both(gauge_block, inputs, 0.99, shortest=True)
    assert round(linear.estimate) == 838
    assert round(linear.standard_uncertainty) == 32
    assert int(linear.dof) == 16
    # The printed interval takes the whole degrees of freedom.
    half = coverage_factor(16, 0.99) * linear.standard_uncertainty
    assert [round(838 - half), round(838 + half)] == pytest.approx([745, 931], abs=1)
    assert round(drawn.estimate) == 838
    assert round(drawn.standard_uncertainty) == 36
    assert ends == pytest.approx((745, 932), abs=2)
    assert check.tolerance == numerical_tolerance(32.0) == 0.5


@pytest.mark.parametrize(
    ("uncertainty", "tolerance"),
    # JCGM 101:2008, 7.9.2, examples 1 and 2, and ends of a decade.
    [(0.00035, 5e-6), (2.0, 0.05), (10.1, 0.5), (0.0996, 0.005), (0.0, 0.0)],
)
def test_the_numerical_tolerance_is_half_a_unit_of_the_second_digit(
    uncertainty: float, tolerance: float
):
    assert numerical_tolerance(uncertainty) == pytest.approx(tolerance)
