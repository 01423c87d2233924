"""Fitted polynomials agree with other programs, closed forms and certified numbers."""

import numpy as np
import pytest
from commands import XB1
from rigs import make_case, make_records
from scipy import stats

from hdcal.classical.fit import fit
from hdcal.classical.polynomial import Polynomial, fit_polynomial
from hdcal.data.reading import read_case
from hdcal.errors import InputError

# NIST StRD, linear regression, Pontius: deflection as a quadratic of load. The
# estimates and standard deviations as certified to 15 digits.
CERTIFIED = [0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14]
CERTIFIED_SD = [0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16]
CERTIFIED_S, CERTIFIED_R2 = 0.205177424076185e-03, 0.999999900178537


@pytest.fixture(scope="module")
def wavy() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(0.1, 0.6, 25))
    return x, 200.0 * x + 5.0 * np.sin(9.0 * x) + rng.normal(0.0, 1.0, 25)


def values(found: Polynomial) -> list[float]:
    return [one.value for one in found.coefficients]


def errors(found: Polynomial) -> list[float]:
    return [one.standard_error for one in found.coefficients]


def test_a_straight_line_is_that_of_scipy(wavy):
    found, other = fit_polynomial(*wavy, 1), stats.linregress(*wavy)
    assert values(found) == pytest.approx([other.intercept, other.slope], rel=1e-12)
    expected = [other.intercept_stderr, other.stderr]
    assert errors(found) == pytest.approx(expected, rel=1e-10)
    assert found.r2 == pytest.approx(other.rvalue**2, rel=1e-12)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_a_polynomial_is_that_of_numpy(wavy, degree):
    found = fit_polynomial(*wavy, degree)
    coefficients, covariance = np.polyfit(*wavy, degree, cov=True)
    np.testing.assert_allclose(found.polyfit_order, coefficients, rtol=1e-8)
    np.testing.assert_allclose(found.covariance[::-1, ::-1], covariance, rtol=1e-7)
    design = np.vander(wavy[0], degree + 1)
    assert found.condition_number == pytest.approx(np.linalg.cond(design), rel=1e-8)


def test_certified_numbers_of_nist_are_met():
    records = read_case(XB1.parent / "nist-pontius").records
    found = fit_polynomial(records.force, records.deformation, 2)
    assert values(found) == pytest.approx(CERTIFIED, rel=1e-9)
    assert errors(found) == pytest.approx(CERTIFIED_SD, rel=1e-9)
    assert found.s_N == pytest.approx(CERTIFIED_S, rel=1e-9)
    assert found.r2 == pytest.approx(CERTIFIED_R2, abs=1e-14)
    assert found.dof == 37


def test_the_line_is_too_simple_for_table_2_and_the_parabola_is_not():
    line, _, parabola, _ = fit(read_case(XB1), [1, 2])
    assert line.lack_of_fit.against == "next degree"
    assert line.lack_of_fit.dof == (1, 11)
    assert pytest.approx(34.2, abs=0.05) == line.lack_of_fit.F
    assert line.lack_of_fit.p_value == pytest.approx(1.1e-4, abs=1e-5)
    assert parabola.lack_of_fit.p_value == pytest.approx(0.76, abs=0.005)
    assert (line.lack_of_fit.too_simple, parabola.lack_of_fit.too_simple) == (1, 0)


def refitted_error(x, y, degree, intercept, group) -> float:
    """The error on groups left out one by one, by fitting the other rows."""
    total = 0.0
    for one in np.unique(group):
        kept = fit_polynomial(x[group != one], y[group != one], degree, intercept)
        left = y[group == one] - np.polyval(kept.polyfit_order, x[group == one])
        total += np.sum(left**2)
    return np.sqrt(total / len(x))


@pytest.mark.parametrize("curve", [(1, True), (2, False), (3, True)])
def test_held_out_errors_are_those_of_refitting(wavy, curve):
    run = np.arange(25) % 3
    found = fit_polynomial(*wavy, *curve, run=run)
    by_row = refitted_error(*wavy, *curve, np.arange(25))
    assert found.held_out_rows_N == pytest.approx(by_row, rel=1e-9)
    by_run = refitted_error(*wavy, *curve, run)
    assert found.held_out_runs_N == pytest.approx(by_run, rel=1e-9)


def test_runs_that_alone_determine_the_curve_cannot_be_left_out():
    x = np.array([0.1, 0.1, 0.1, 0.2, 0.3, 0.4])
    found = fit_polynomial(x, x**2, 1, run=np.array([0, 0, 0, 1, 1, 1]))
    assert found.held_out_runs_N is None
    assert found.held_out_rows_N is not None


def test_the_criterion_is_that_of_the_normal_likelihood(wavy):
    x, y = wavy
    found = fit_polynomial(x, y, 1)
    fitted = np.polyval(found.polyfit_order, x)
    sd = np.sqrt(np.mean((y - fitted) ** 2))
    deviance = -2.0 * np.sum(stats.norm.logpdf(y, fitted, sd))
    free, n = 3, len(x)
    correction = 2 * free + 2 * free * (free + 1) / (n - free - 1)
    assert found.aicc == pytest.approx(deviance + correction, rel=1e-12)


def test_pure_error_is_that_of_the_text_book():
    x = np.repeat([0.1, 0.2, 0.3, 0.4], 2)
    y = np.array([19.0, 21.0, 40.0, 41.0, 62.0, 60.0, 85.0, 83.0])
    found = fit_polynomial(x, y, 1).lack_of_fit
    pure = 2.0 + 0.5 + 2.0 + 2.0
    line = stats.linregress(x, y)
    squares = np.sum((y - line.intercept - line.slope * x) ** 2)
    assert (found.against, found.dof) == ("pure error", (2, 4))
    assert pytest.approx((squares - pure) / 2 / (pure / 4), rel=1e-9) == found.F


def simulated(curvature: float, repeats: int, seed: int):
    rng = np.random.default_rng(seed)
    x = np.repeat(np.linspace(0.05, 0.55, 7), repeats)
    mean = 200.0 * x + curvature * x**2
    for _ in range(400):
        yield fit_polynomial(x, mean + rng.normal(0.0, 0.8, len(x)), 1)


@pytest.mark.parametrize("repeats", [1, 3])
def test_p_values_are_uniform_for_a_line_and_small_for_a_curve(repeats):
    right = [found.lack_of_fit.p_value for found in simulated(0.0, repeats, 2)]
    assert stats.kstest(right, "uniform").pvalue > 0.01
    wrong = [found.lack_of_fit.p_value for found in simulated(60.0, repeats, 3)]
    assert np.mean(np.array(wrong) < 0.05) > 0.9


def test_confidence_intervals_have_their_coverage_if_the_curve_is_right():
    def coverage(curvature):
        inside = []
        for found in simulated(curvature, 3, 4):
            at, slope = found.force_at(0.55), found.coefficients[1]
            mean = 200.0 * 0.55 + curvature * 0.55**2
            inside.append((slope.lo < 200.0 < slope.hi, at.lo_N < mean < at.hi_N))
        return np.mean(inside, axis=0)

    spread = 3.0 * np.sqrt(0.95 * 0.05 / 400)
    assert np.all(np.abs(coverage(0.0) - 0.95) < spread)
    assert np.all(coverage(60.0) < 0.95 - spread)


def test_too_few_different_deformations_are_refused():
    case = make_case(make_records([0.1, 0.1, 0.2, 0.2, 0.3], [1.0, 2, 3, 4, 5]))
    assert len(fit(case, [2])) == 2
    with pytest.raises(InputError, match="3 different deformations do not fix degree"):
        fit(case, [3])
    close = make_case(make_records(0.3 + 1e-9 * np.arange(8.0), np.arange(8.0)))
    with pytest.raises(InputError, match="leaves no digits"):
        fit(close, [3])


def test_exact_data_have_no_scatter_to_compare_with():
    x = np.array([0.0, 0.25, 0.5, 1.0, 0.0])
    found = fit_polynomial(x, np.zeros(5), 1)
    none = found.r2, found.r2_adjusted, found.aicc, found.lack_of_fit
    assert found.s_N == 0.0 and none == (None,) * 4
