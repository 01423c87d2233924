"""The parts of a budget do what closed forms and simulations say."""

import numpy as np
import pytest
from propagation import monte_carlo
from rigs import make_gear
from scipy import stats

from hdcal.prediction.budget.inputs import (
    independent,
    joined_inputs,
    limited_input,
    one_input,
    scatter_law,
)
from hdcal.prediction.budget.linear import (
    check_linear,
    coverage_factor,
    effective_dof,
    linear_budget,
)
from hdcal.prediction.budget.risk import global_false_accept

make_gear()  # double precision


def test_blocks_are_independent_and_keep_the_variance():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T
    depend, blocks = independent(covariance, [1, 2, 3])
    diagonal = np.zeros((6, 6))
    for place, block in zip(([0], [1, 2], [3, 4, 5]), blocks, strict=True):
        diagonal[np.ix_(place, place)] = block
    assert depend @ diagonal @ depend.T == pytest.approx(covariance)
    assert np.allclose(depend, np.tril(depend))
    # A parameter that is held has no part in anything.
    held = np.diag([0.0, 1.0])
    depend, blocks = independent(held, [1, 1])
    assert depend == pytest.approx(np.eye(2)) and blocks[0] == 0.0


def test_what_is_left_of_a_tie_to_chance_is_a_covariance():
    """Two inputs hang together, and a third only seems to with one of them."""
    covariance = np.array([[1.0, 0.01, 0.9998], [0.01, 1.0, 0.02], [0.9998, 0.02, 1.0]])
    for chance in (0.0, 0.02):
        _, (_, left) = independent(covariance, [1, 2], chance)
        assert np.linalg.eigvalsh(left).min() > 0.0


def test_a_tie_is_cut_whole_or_not_at_all():
    """A force to which two inputs trade a third: parts of a tie would not cancel."""
    rng, force, ratios = np.random.default_rng(7), np.array([1.0, -1.0, -1.0]), []
    for _ in range(50):
        zero, slack = rng.normal(size=(2, 400))
        known = zero - slack + rng.normal(0.0, 0.03, 400)
        covariance = np.cov([zero, known, slack])
        depend, blocks = independent(covariance, [1, 2], 4.0 / 20.0)
        turned = force @ depend
        found = turned[0] ** 2 * blocks[0][0, 0] + turned[1:] @ blocks[1] @ turned[1:]
        ratios.append(found / (force @ covariance @ force))
    assert min(ratios) > 0.9 and max(ratios) < 1.1


@pytest.mark.parametrize("dof", [6.0, 12.0, 40.0])
def test_scatter_of_unknown_variance_is_the_student_t_it_came_from(dof: float):
    """Draws of σ² are ν s²/χ² at the levels of a fine grid."""
    levels = (np.arange(200_000) + 0.5) / 200_000
    variances = dof * 0.7**2 / stats.chi2.ppf(levels, dof)
    scale, found = scatter_law(variances)
    assert found == pytest.approx(dof, rel=0.05)
    assert scale == pytest.approx(0.7, rel=0.01)
    assert scatter_law(np.full(9, 4.0)) == (2.0, np.inf)


def test_a_line_fitted_to_points_has_the_interval_of_student_exactly():
    """Noise and fit share their unknown variance: one group, one t."""
    place, dof, scatter = np.linspace(0.0, 1.0, 8), 6, 0.3
    columns = np.stack([np.ones(8), place], axis=1)
    ties = scatter**2 * np.linalg.inv(columns.T @ columns)
    covariance = np.zeros((3, 3))
    covariance[:2, :2], covariance[2, 2] = ties, scatter**2
    group = joined_inputs(("zero", "slope", "noise"), [1.0, 2.0, 0.0], covariance, dof)
    found = linear_budget(_line, [group])
    at = np.array([1.0, 0.8])
    sd = scatter * np.sqrt(1.0 + at @ np.linalg.inv(columns.T @ columns) @ at)
    exact = stats.t.interval(0.95, dof, loc=2.6, scale=sd)
    assert found.interval() == pytest.approx(exact)
    drawn = monte_carlo(_line, [group], 400_000).interval()
    assert drawn == pytest.approx(exact, abs=0.01)
    # As if they were independent the degrees of freedom would be too many.
    apart = [
        joined_inputs(("zero", "slope"), [1.0, 2.0], ties, dof),
        one_input("noise", 0.0, scatter, dof),
    ]
    assert linear_budget(_line, apart).dof > 1.2 * found.dof


def _line(x):
    return x[0] + 0.8 * x[1] + x[2]


def test_what_is_bent_is_flagged_and_what_is_straight_is_not():
    inputs = [limited_input("x", -1.0, 1.0, "triangular"), one_input("y", 0.0, 1.0)]
    for model, stands in ((_straight, True), (_bent, False)):
        linear = linear_budget(model, inputs)
        drawn = monte_carlo(model, inputs, 1_000_000)
        about = linear.interval(), drawn.interval(), linear.standard_uncertainty
        assert check_linear(*about).valid is stands


def _straight(x):
    return 3.0 + 0.5 * x[0] + 2.0 * x[1]


def _bent(x):
    return _straight(x) + 0.3 * x[1] ** 2


def test_effective_degrees_of_freedom_lie_between_the_least_and_their_sum():
    assert effective_dof(np.array([1.0, 1.0]), np.array([5.0, 5.0])) == 10.0
    assert effective_dof(np.array([1.0, 0.0]), np.array([5.0, 2.0])) == 5.0
    assert effective_dof(np.array([1.0, 1.0]), np.full(2, np.inf)) == np.inf
    assert coverage_factor(np.inf) == pytest.approx(1.959964, abs=1e-6)
    assert coverage_factor(2e9) == pytest.approx(stats.t.ppf(0.975, 2e9), abs=1e-6)


def test_the_global_risk_is_that_of_the_resistors():
    """JCGM 106:2012, 9.5.3: 1500 Ω ± 0.2 Ω, accepted within ± 0.18 Ω; R_C = 1 %."""
    each = global_false_accept(1500.0, 0.12, 0.04, 1500.2, 1500.18)
    assert round(2.0 * each, 2) == 0.01


@pytest.mark.parametrize("most", [90.0, 92.0, 95.0])
def test_the_global_risk_is_the_share_of_simulated_gears(most: float):
    rng = np.random.default_rng(8)
    force = rng.normal(88.0, 3.0, 2_000_000)
    accepted = force + rng.normal(0.0, 1.5, force.size) <= most
    share = np.mean((force > 92.0) & accepted)
    found = global_false_accept(88.0, 3.0, 1.5, 92.0, most)
    assert found == pytest.approx(share, abs=4.0 * np.sqrt(share / force.size))


def test_the_global_risk_at_its_ends():
    assert global_false_accept(80.0, 0.0, 1.0, 90.0, 88.0) == 0.0
    half = global_false_accept(91.0, 0.0, 1.0, 90.0, 91.0)
    assert half == pytest.approx(0.5)
    assert global_false_accept(80.0, 1.0, 1.0, 99.0, 98.0) == 0.0
    # A perfect measurement accepts nothing that exceeds the limit.
    assert global_false_accept(89.0, 2.0, 0.0, 90.0, 90.0) == 0.0
    loose = global_false_accept(89.0, 2.0, 0.0, 90.0, 91.0)
    assert loose == pytest.approx(stats.norm.cdf(1.0) - stats.norm.cdf(0.5), abs=1e-6)
