"""Fitted polynomials agree with other programs, closed forms and certified numbers."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import XB1, Hdcal
from rigs import make_case, make_records
from schema_checks import obeys

from hdcal.classical.fit import Fits, fit, fit_polynomial
from hdcal.data.reading import read_case
from hdcal.errors import InputError

PONTIUS = XB1.parent / "nist-pontius"
# NIST StRD, linear regression, Pontius: deflection as a quadratic of load. The
# estimates and standard deviations as certified to 15 digits.
CERTIFIED = [0.673565789473684e-03, 0.732059160401003e-06, -0.316081871345029e-14]
CERTIFIED_SD = [0.107938612033077e-03, 0.157817399981659e-09, 0.486652849992036e-16]
CERTIFIED_S, CERTIFIED_R2 = 0.205177424076185e-03, 0.999999900178537


@pytest.mark.parametrize("degree", [1, 5])
def test_a_polynomial_is_that_of_numpy(degree):
    rng = np.random.default_rng(1)
    x = np.sort(rng.uniform(0.1, 0.6, 25))
    y = 200.0 * x + 5.0 * np.sin(9.0 * x) + rng.normal(0.0, 1.0, 25)
    found = fit_polynomial(x, y, degree, True)
    coefficients, covariance = np.polyfit(x, y, degree, cov=True)
    np.testing.assert_allclose(found.polyfit_order, coefficients, rtol=1e-8)
    np.testing.assert_allclose(found.covariance[::-1, ::-1], covariance, rtol=1e-7)


def test_certified_numbers_of_nist_are_met():
    records = read_case(PONTIUS).records
    load, deflection = np.asarray(records.force), np.asarray(records.deformation)
    found = fit_polynomial(load, deflection, 2, True)
    values = [one.value for one in found.coefficients]
    errors = [one.standard_error for one in found.coefficients]
    assert values == pytest.approx(CERTIFIED, rel=1e-9)
    assert errors == pytest.approx(CERTIFIED_SD, rel=1e-9)
    assert (found.s_N, found.dof) == (pytest.approx(CERTIFIED_S, rel=1e-9), 37)
    assert found.r2 == pytest.approx(CERTIFIED_R2, abs=1e-14)


@pytest.mark.parametrize(("curvature", "right"), [(0.0, True), (60.0, False)])
def test_error_rates_are_nominal_only_if_the_curve_is_right(curvature, right):
    rng, x = np.random.default_rng(3), np.tile(np.linspace(0.1, 0.6, 8), 3)
    inside, count = [], 400
    for _ in range(count):
        y = 200.0 * x + curvature * x**2 + rng.normal(0.0, 1.0, len(x))
        found = fit_polynomial(x, y, 1, True)
        (force,), (half,), _ = found.curve(np.array([0.55]))
        mean, slope = 200.0 * 0.55 + curvature * 0.55**2, found.coefficients[1]
        inside.append([slope.lo < 200.0 < slope.hi, abs(force - mean) < half])
    spread = 3.0 * np.sqrt(0.95 * 0.05 / count)
    assert np.all((np.mean(inside, axis=0) > 0.95 - spread) == right)


def test_results_rank_and_compare_the_curves():
    found = fit(read_case(PONTIUS), [1, 2], at=1.0)
    obeys(found.to_dict(), Fits)
    best = min(found.fits, key=lambda one: one.aicc)
    assert best.force_N.median == pytest.approx(np.polyval(best.polyfit_order, 1.0))
    assert best.reading_N.lo < best.force_N.lo < best.force_N.hi < best.reading_N.hi
    assert found.headline.startswith(f"{best.model} has")
    assert "2 runs" in " ".join(found.notes)


def test_rows_that_do_not_determine_a_curve_are_refused():
    case = make_case(make_records([0.1, 0.1, 0.2, 0.2, 0.3], [1.0, 2, 3, 4, 5]))
    assert len(fit(case, [2]).fits) == 2
    close = make_case(make_records(0.3 + 1e-9 * np.arange(8.0), np.arange(8.0)))
    for one, degrees in ((case, [3]), (close, [3]), (case, [0]), (case, [1, 10])):
        with pytest.raises(InputError, match="degree"):
            fit(one, degrees)
    exact = fit_polynomial(np.array([0.0, 0.5, 1.0, 0.0]), np.zeros(4), 1, True)
    assert (exact.s_N, exact.r2, exact.aicc) == (0.0, None, None)


def test_the_command_prints_and_writes(here: Hdcal, tmp_path: Path):
    arguments = ["fit", XB1, "--degree", "1,2", "--out", tmp_path / "fits", "--json"]
    done = here(*arguments)
    found = json.loads(done.stdout)
    assert (found["schema"], found["status"]) == ("hdcal.fit/1", "ok")
    assert found["fits"][0]["polyfit_order"] == pytest.approx([209.409, -4.24676], 1e-5)
    assert found["at_mm"] == 0.4 and "polyval([209.409 -4.24676], w)" in done.stderr
    names = {entry.name for entry in (tmp_path / "fits").iterdir()}
    assert names > {"fit.json", "fit.svg", "fit.png", "report.html"}
    done = here("fit", tmp_path / "no.csv", "--degree", "one", "--out", "a/b")
    assert done.returncode == 2 and done.stdout == ""
    assert all(w in done.stderr for w in ("no.csv", "'one' is neither", "a/b"))
    assert here("fit", XB1, "--at", "400").returncode == 2
