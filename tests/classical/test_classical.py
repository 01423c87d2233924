"""Classical fits agree with other people's programs and with certified numbers."""

from pathlib import Path

import numpy as np
import pytest
from rigs import make_case, make_records
from scipy import stats

from hdcal.classical.fit.document import notes
from hdcal.classical.fit.fit import fit, fit_powers
from hdcal.classical.fit.notation import model_name
from hdcal.classical.fit.summary import fit_answer
from hdcal.data.reading import read_case
from hdcal.errors import InputError
from hdcal.report.plain import as_plain

DATASETS = Path(__file__).parents[2] / "datasets"
# NIST StRD, linear regression, Pontius: deflection as a quadratic of load. The
# estimates and standard deviations as certified to 15 digits.
CERTIFIED = [0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14]
CERTIFIED_SD = [0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16]
CERTIFIED_S, CERTIFIED_R2 = 0.205177424076185e-03, 0.999999900178537


@pytest.fixture(scope="module")
def xb1():
    return read_case(DATASETS / "xb1-100-80")


@pytest.fixture(scope="module")
def pontius():
    return read_case(DATASETS / "nist-pontius")


@pytest.fixture(scope="module")
def wavy() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(0.1, 0.6, 25))
    return x, 200.0 * x + 5.0 * np.sin(9.0 * x) + rng.normal(0.0, 1.0, 25)


def test_a_straight_line_is_that_of_scipy(wavy):
    found, other = fit_powers(*wavy, (0, 1)), stats.linregress(*wavy)
    expected = [other.intercept, other.slope]
    np.testing.assert_allclose(found.coefficients, expected, rtol=1e-12)
    expected = [other.intercept_stderr, other.stderr]
    np.testing.assert_allclose(found.standard_errors, expected, rtol=1e-10)
    assert found.r2 == pytest.approx(other.rvalue**2, rel=1e-12)


@pytest.mark.parametrize("degree", [2, 3, 5])
def test_a_polynomial_is_that_of_numpy(wavy, degree):
    found = fit_powers(*wavy, tuple(range(degree + 1)))
    coefficients, covariance = np.polyfit(*wavy, degree, cov=True)
    np.testing.assert_allclose(found.coefficients[::-1], coefficients, rtol=1e-8)
    np.testing.assert_allclose(found.covariance[::-1, ::-1], covariance, rtol=1e-7)
    design = np.vander(wavy[0], degree + 1)
    assert found.condition_number == pytest.approx(np.linalg.cond(design), rel=1e-8)


def test_certified_numbers_of_nist_are_met(pontius):
    load, deflection = pontius.records.force, pontius.records.deformation
    found = fit_powers(load, deflection, (0, 1, 2))
    np.testing.assert_allclose(found.coefficients, CERTIFIED, rtol=1e-9)
    np.testing.assert_allclose(found.standard_errors, CERTIFIED_SD, rtol=1e-9)
    assert found.s == pytest.approx(CERTIFIED_S, rel=1e-9)
    assert found.r2 == pytest.approx(CERTIFIED_R2, abs=1e-14)
    assert found.dof == 37


# Table 2: coefficients, residual sd [N] and R² as the audit of the article prints them.
TABLE_2 = [
    (1, False, [198.02], 2.727, 0.99396),
    (1, True, [-4.247, 209.41], 1.678, 0.99789),
    (2, False, [168.15, 71.2], 0.928, 0.99935),
    (2, True, [-1.177, 176.61, 58.58], 0.864, 0.99949),
    (3, True, [-1.384, 180.98, 39.12, 23.17], 0.902, 0.99949),
]


@pytest.mark.parametrize(("degree", "intercept", "coefficients", "s", "r2"), TABLE_2)
def test_table_2_gives_its_known_fits(xb1, degree, intercept, coefficients, s, r2):
    found = next(f for f in fit(xb1, [degree]) if (f.powers[0] == 0) == intercept)
    digits = [len(str(number).partition(".")[2]) for number in coefficients]
    rounded = [
        round(float(c), d) for c, d in zip(found.coefficients, digits, strict=True)
    ]
    assert rounded == coefficients
    assert (round(found.s, 3), round(found.r2, 5)) == (s, r2)


def test_the_line_is_too_simple_and_the_parabola_is_not(xb1):
    line, parabola = (fit(xb1, [degree])[0].lack_of_fit for degree in (1, 2))
    assert line.against == parabola.against == "next degree"
    assert line.dof == (1, 11)
    assert pytest.approx(34.2, abs=0.05) == line.F
    assert line.p_value == pytest.approx(1.1e-4, abs=1e-5)
    assert parabola.p_value == pytest.approx(0.76, abs=0.005)


def refitted_error(x, y, powers, group) -> float:
    """The slow twin: leave a group out, fit the rest, look at what was left out."""
    total = 0.0
    for one in np.unique(group):
        kept = fit_powers(x[group != one], y[group != one], powers)
        left = x[group == one][:, None] ** np.array(powers)
        total += np.sum((y[group == one] - left @ kept.coefficients) ** 2)
    return np.sqrt(total / len(x))


@pytest.mark.parametrize("powers", [(0, 1), (1, 2), (0, 1, 2, 3)])
def test_held_out_errors_are_those_of_refitting(wavy, powers):
    x, y = wavy
    run = np.arange(len(x)) % 3
    found = fit_powers(x, y, powers, run=run)
    by_row = refitted_error(x, y, powers, np.arange(len(x)))
    assert found.held_out == pytest.approx(by_row, rel=1e-9)
    assert found.held_out_runs == pytest.approx(
        refitted_error(x, y, powers, run), rel=1e-9
    )


def test_runs_that_alone_fix_the_curve_cannot_be_left_out():
    x = np.array([0.1, 0.1, 0.1, 0.2, 0.3, 0.4])
    found = fit_powers(x, x**2, (0, 1), run=np.array([0, 0, 0, 1, 1, 1]))
    assert found.held_out_runs is None
    assert found.held_out is not None


def test_the_criterion_is_that_of_the_normal_likelihood(wavy):
    x, y = wavy
    found = fit_powers(x, y, (0, 1))
    fitted = found.coefficients @ x ** np.array([[0], [1]])
    sd = np.sqrt(np.mean((y - fitted) ** 2))
    deviance = -2.0 * np.sum(stats.norm.logpdf(y, fitted, sd))
    free, n = 3, len(x)
    correction = 2 * free + 2 * free * (free + 1) / (n - free - 1)
    assert found.aicc == pytest.approx(deviance + correction, rel=1e-12)


def test_pure_error_is_that_of_the_text_book():
    x = np.repeat([0.1, 0.2, 0.3, 0.4], 2)
    y = np.array([19.0, 21.0, 40.0, 41.0, 62.0, 60.0, 85.0, 83.0])
    found = fit_powers(x, y, (0, 1)).lack_of_fit
    pure = 2.0 + 0.5 + 2.0 + 2.0
    line = stats.linregress(x, y)
    squares = np.sum((y - line.intercept - line.slope * x) ** 2)
    assert (found.against, found.dof) == ("pure error", (2, 4))
    assert pytest.approx((squares - pure) / 2 / (pure / 4), rel=1e-9) == found.F


def simulated(curvature: float, repeats: int, seed: int):
    rng = np.random.default_rng(seed)
    x = np.repeat(np.linspace(0.05, 0.55, 7), repeats)
    for _ in range(400):
        mean = 200.0 * x + curvature * x**2
        yield fit_powers(x, mean + rng.normal(0.0, 0.8, len(x)), (0, 1)), mean


@pytest.mark.parametrize("repeats", [1, 3])
def test_the_test_of_fit_is_right_by_chance_and_sees_a_curve(repeats):
    right = [found.lack_of_fit.p_value for found, _ in simulated(0.0, repeats, 2)]
    assert stats.kstest(right, "uniform").pvalue > 0.01
    wrong = [found.lack_of_fit.p_value for found, _ in simulated(60.0, repeats, 3)]
    assert np.mean(np.array(wrong) < 0.05) > 0.9


def test_confidence_intervals_hold_what_they_promise():
    def share(curvature):
        inside = []
        for found, _ in simulated(curvature, 3, 4):
            at, (low, high) = found.at(0.55), found.confidence
            mean = 200.0 * 0.55 + curvature * 0.55**2
            inside.append((low[1] < 200.0 < high[1], at["lo"] < mean < at["hi"]))
        return np.mean(inside, axis=0)

    spread = 3.0 * np.sqrt(0.95 * 0.05 / 400)
    assert np.all(np.abs(share(0.0) - 0.95) < spread)
    # A line through a curve: its intervals know nothing of that.
    assert np.all(share(60.0) < 0.95 - spread)


@pytest.mark.parametrize(
    ("degrees", "words"),
    [
        ([0], "0 does not lie between 1 and 9"),
        ([1, 10], "10 does not lie between 1 and 9"),
        ([], "is empty"),
    ],
)
def test_degrees_out_of_range_are_refused(xb1, degrees, words):
    with pytest.raises(InputError, match=words):
        fit(xb1, degrees)


def test_too_few_different_deformations_are_refused():
    case = make_case(make_records([0.1, 0.1, 0.2, 0.2, 0.3], [1.0, 2, 3, 4, 5]))
    assert len(fit(case, [2])) == 2
    with pytest.raises(InputError, match="3 different deformations do not fix degree"):
        fit(case, [3])
    close = make_case(make_records(0.3 + 1e-9 * np.arange(8.0), np.arange(8.0)))
    with pytest.raises(InputError, match="leaves no digits"):
        fit(close, [3])


def test_exact_data_leave_nothing_to_divide_by():
    x = np.array([0.0, 0.25, 0.5, 1.0, 0.0])
    found = fit_powers(x, np.zeros(5), (0, 1))
    assert (found.s, found.r2, found.aicc, found.lack_of_fit) == (0.0, None, None, None)


def test_the_summary_says_what_the_curves_leave_out(pontius):
    case = read_case(DATASETS / "thermal-demo")
    told = " ".join(fit_answer(case, fit(case)).notes)
    assert "no curve here knows it" in told
    assert "loading and unloading are fitted as one curve: they lie" in told
    found = as_plain(fit_answer(pontius, fit(pontius, [1, 2]), at=1.0))
    assert "2 runs are fitted as one" in " ".join(found["notes"])
    assert found["fits"][0]["held_out_runs_N"] > found["fits"][2]["held_out_runs_N"]
    assert min(one["aicc_over_best"] for one in found["fits"]) == 0.0
    top = found["fits"][2]
    assert top["model"] == model_name((0, 1, 2)) == "c + a ω + b ω²"
    force = np.polyval(top["polyfit_order"], 1.0)
    assert top["at"]["force_N"] == pytest.approx(force, rel=1e-12)
    with pytest.raises(InputError, match="no deformation of this gear"):
        fit_answer(pontius, fit(pontius), at=400.0)


def test_a_loop_that_counts_as_scatter_is_told_with_its_width():
    up = np.linspace(0.0, 0.5, 26)
    x = np.concatenate([up, up[-2::-1]])
    force = 100.0 * x + 0.9 * np.where(np.arange(51) < 26, 1.0, -1.0)
    force += 0.05 * np.random.default_rng(0).normal(size=51)
    case = read_case({"deformation_mm": x, "force_N": force})
    told = notes(case)
    assert any("they lie 1.8 N apart in the mean" in words for words in told)
