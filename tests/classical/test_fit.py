"""Fitted polynomials agree with other programs, closed forms and certified numbers."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import XB1, Hdcal
from rigs import make_case, make_records
from schema_checks import obeys
from scipy import stats

from hdcal.classical.fit import Fits, fit, fit_polynomial
from hdcal.data.reading import read_case
from hdcal.errors import InputError

PONTIUS = XB1.parent / "nist-pontius"
# NIST StRD, linear regression, Pontius: deflection as a quadratic of load. The
# estimates and standard deviations as certified to 15 digits.
CERTIFIED = [0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14]
CERTIFIED_SD = [0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16]
CERTIFIED_S, CERTIFIED_R2 = 0.205177424076185e-03, 0.999999900178537
ROWS = np.arange(25)


@pytest.fixture(scope="module")
def wavy() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(0.1, 0.6, 25))
    return x, 200.0 * x + 5.0 * np.sin(9.0 * x) + rng.normal(0.0, 1.0, 25)


def test_a_straight_line_is_that_of_scipy(wavy):
    found, other = fit_polynomial(*wavy, 1, True, ROWS), stats.linregress(*wavy)
    intercept, slope = found.coefficients
    assert intercept.value == pytest.approx(other.intercept, rel=1e-12)
    assert slope.standard_error == pytest.approx(other.stderr, rel=1e-10)
    assert found.r2 == pytest.approx(other.rvalue**2, rel=1e-12)


@pytest.mark.parametrize("degree", [2, 5])
def test_a_polynomial_is_that_of_numpy(wavy, degree):
    found = fit_polynomial(*wavy, degree, True, ROWS)
    coefficients, covariance = np.polyfit(*wavy, degree, cov=True)
    np.testing.assert_allclose(found.polyfit_order, coefficients, rtol=1e-8)
    np.testing.assert_allclose(found.covariance[::-1, ::-1], covariance, rtol=1e-7)


def test_certified_numbers_of_nist_are_met():
    records = read_case(PONTIUS).records
    load, deflection = np.asarray(records.force), np.asarray(records.deformation)
    found = fit_polynomial(load, deflection, 2, True, np.arange(40))
    values = [one.value for one in found.coefficients]
    errors = [one.standard_error for one in found.coefficients]
    assert values == pytest.approx(CERTIFIED, rel=1e-9)
    assert errors == pytest.approx(CERTIFIED_SD, rel=1e-9)
    assert (found.s_N, found.dof) == (pytest.approx(CERTIFIED_S, rel=1e-9), 37)
    assert found.r2 == pytest.approx(CERTIFIED_R2, abs=1e-14)


def simulated(curvature: float, count: int):
    """Yield straight lines fitted to rows of which each was measured three times."""
    rng, x = np.random.default_rng(3), np.tile(np.linspace(0.1, 0.6, 8), 3)
    for _ in range(count):
        y = 200.0 * x + curvature * x**2 + rng.normal(0.0, 1.0, len(x))
        yield fit_polynomial(x, y, 1, True, np.arange(24) % 8)


@pytest.mark.parametrize(("curvature", "right"), [(0.0, True), (60.0, False)])
def test_error_rates_are_nominal_only_if_the_curve_is_right(curvature, right):
    inside, small, count = [], [], 400
    for found in simulated(curvature, count):
        (force,), (half,), _ = found.curve(np.array([0.55]))
        mean, slope = 200.0 * 0.55 + curvature * 0.55**2, found.coefficients[1]
        inside.append([slope.lo < 200.0 < slope.hi, abs(force - mean) < half])
        small.append(found.lack_of_fit.p_value < 0.05)
    spread = 3.0 * np.sqrt(0.95 * 0.05 / count)
    assert np.all((np.mean(inside, axis=0) > 0.95 - spread) == right)
    assert np.mean(small) == pytest.approx(0.05, abs=spread) or not right
    assert right or np.mean(small) > 0.9


def test_results_rank_and_compare_the_curves():
    found = fit(read_case(PONTIUS), [1, 2], at=1.0)
    obeys(found.to_dict(), Fits)
    assert [one.model for one in found.fits][::2] == ["c + a ω", "c + a ω + b ω²"]
    best = min(found.fits, key=lambda one: one.aicc)
    assert best.force_N.median == pytest.approx(np.polyval(best.polyfit_order, 1.0))
    assert best.reading_N.lo < best.force_N.lo < best.force_N.hi < best.reading_N.hi
    assert found.headline.startswith(f"{best.model} has")
    assert "2 runs" in " ".join(found.notes)
    assert found.to_frame().force_N[0] == found.fits[0].force_N.median
    assert any(
        "20 to 80" in n for n in fit(read_case(XB1.parent / "thermal-demo")).notes
    )


def test_rows_that_do_not_determine_a_curve_are_refused():
    case = make_case(make_records([0.1, 0.1, 0.2, 0.2, 0.3], [1.0, 2, 3, 4, 5]))
    assert len(fit(case, [2]).fits) == 2
    close = make_case(make_records(0.3 + 1e-9 * np.arange(8.0), np.arange(8.0)))
    for one, degrees in ((case, [3]), (close, [3]), (case, [0]), (case, [1, 10])):
        with pytest.raises(InputError, match="degree"):
            fit(one, degrees)
    exact = fit_polynomial(
        np.array([0.0, 0.5, 1.0, 0.0]), np.zeros(4), 1, True, ROWS[:4]
    )
    assert exact.s_N == 0.0 and (exact.r2, exact.aicc, exact.lack_of_fit) == (None,) * 3


def test_the_command_prints_and_writes(here: Hdcal, tmp_path: Path):
    arguments = ["fit", XB1, "--degree", "1,2", "--out", tmp_path / "fits", "--json"]
    done = here(*arguments)
    found = json.loads(done.stdout)
    assert (found["schema"], found["status"]) == ("hdcal.fit/1", "ok")
    assert found["fits"][0]["polyfit_order"] == pytest.approx([209.409, -4.24676], 1e-5)
    assert found["at_mm"] == 0.4 and "polyval([209.409 -4.24676], w)" in done.stderr
    names = {entry.name for entry in (tmp_path / "fits").iterdir()}
    assert names > {"fit.json", "fit.svg", "fit.png", "report.html"}
    assert here(*arguments).returncode == 2
    done = here("fit", tmp_path / "no.csv", "--degree", "one", "--out", "a/b")
    assert done.returncode == 2 and done.stdout == ""
    assert all(w in done.stderr for w in ("no.csv", "'one' is neither", "a/b"))
    assert here("fit", XB1, "--at", "400").returncode == 2
