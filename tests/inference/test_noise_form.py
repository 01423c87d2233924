"""Noise is correlated or grows where readings do so, and the answers allow for it."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import autoregression, make_case, make_gear, make_records

from hdcal.calibration.calibrate import calibrate
from hdcal.data.priors import Prior
from hdcal.inference.checks import correlation_check, growth_check
from hdcal.inference.noise_form import correlates, noise_grows
from hdcal.inference.serial_correlation import CORRELATION, previous_rows, whiten
from hdcal.physics.effect import Noise, Rows, parameters
from hdcal.physics.registry import EFFECTS

SLOPE, ROWS = 205.0, 60
X = np.linspace(0.02, 0.54, ROWS)
SHORT = {"chains": 2, "warmup": 300, "draws": 300}


def case_of(noise, *, x=X, gear=None, **columns):
    return make_case(make_records(x, SLOPE * x - 1.0 + noise, **columns), gear)


def test_neighbours_are_of_one_run_on_one_specimen():
    run, specimen = np.array([0, 1, 0, 1, 1, 0]), np.array([0, 0, 0, 0, 1, 1])
    records = make_records(np.arange(6.0), run=run, specimen=specimen)
    np.testing.assert_array_equal(previous_rows(records), [-1, -1, 0, 1, -1, -1])


def test_whitened_noise_is_independent():
    """The columns of the covariance's root become those of the unit matrix."""
    run = np.repeat([0, 1], [7, 5])
    before = previous_rows(make_records(np.arange(12.0), run=run))
    apart = np.abs(np.arange(12)[:, None] - np.arange(12))
    alike = np.where(run[:, None] == run, 0.7**apart, 0.0)
    root = whiten(np.linalg.cholesky(alike), before, 0.7)
    np.testing.assert_allclose(root, np.eye(12), atol=1e-12)
    # With another correlation they do not.
    assert (
        np.abs(whiten(np.linalg.cholesky(alike), before, 0.5) - np.eye(12)).max() > 0.1
    )


def test_a_mixture_is_declared_as_one():
    """Correlation is inferred of single normals only; an effect says which it is."""
    records = make_records(X)
    rows = Rows(records, 0.0 * X, 0.0 * X + SLOPE, X)
    for name, effect in EFFECTS.items():
        if effect.stage == "noise":
            sizes = {n: about.typical for n, about in parameters(effect).items()}
            noise = Noise(np.zeros(1), np.ones((1, ROWS)))
            found = effect(**sizes).apply(noise, rows)
            assert (len(found.log_weight) > 1) == effect.mixture, name


def test_correlation_is_asked_where_it_can_be_told():
    noise = np.random.default_rng(0).normal(0.0, 0.6, ROWS)
    assert correlates(case_of(noise), ())
    assert not correlates(case_of(noise), (EFFECTS["outliers"],))
    assert not correlates(case_of(noise, run=np.arange(ROWS)), ())
    # Within steps wider than the noise neighbours are alike anyway.
    assert not correlates(case_of(noise, gear=make_gear(resolution=0.98)), ())
    assert correlates(case_of(noise, gear=make_gear(resolution=0.1)), ())
    # Few rows cannot tell it from a leftover discrepancy.
    assert correlates(case_of(noise), (), with_gap=True)
    few = case_of(noise[:14], x=X[:14])
    assert correlates(few, ()) and not correlates(few, (), with_gap=True)


@pytest.fixture(scope="module")
def alike():
    noise = autoregression(np.random.default_rng(3).normal(size=ROWS), 0 * X, 0.7)
    case = case_of(0.6 * noise)
    held = make_gear(noise_correlation=Prior("fixed", (0.0,)))
    return [calibrate(one, **SHORT) for one in (case, case_of(0.6 * noise, gear=held))]


def test_correlated_noise_widens_what_it_should(alike):
    found, independent = alike
    low, high = np.quantile(found.draws[CORRELATION], [0.025, 0.975])
    assert low < 0.7 < high and low > 0.2
    wide, narrow = (np.std(one.draws["stiffness"]) for one in alike)
    # Of a line through 60 readings: √((1 + ρ)/(1 − ρ)) times, less what ρ may be.
    assert 1.5 < wide / narrow < 3.5
    assert correlation_check(found.draws).outcome == "note"
    assert correlation_check(independent.draws).outcome == "passed"


def test_noise_of_one_size_is_seldom_let_grow():
    rng = np.random.default_rng(1)
    for rows, most in ((14, 0.12), (120, 0.08)):
        x = np.linspace(0.02, 0.54, rows)
        grown = [noise_grows(case_of(rng.normal(size=rows), x=x)) for _ in range(400)]
        assert np.mean(grown) < most


def test_noise_in_proportion_to_the_force_is_let_grow():
    rng = np.random.default_rng(2)
    share = [noise_grows(case_of(0.2 * SLOPE * X * rng.normal(size=ROWS))) for _ in X]
    assert np.mean(share) > 0.85
    case = case_of(0.2 * SLOPE * X * rng.normal(size=ROWS))
    found = calibrate(case, **SHORT)
    assert [effect.name for effect in found.effects] == ["heteroscedastic_noise"]
    low, high = np.quantile(found.draws["heteroscedastic_noise.share"], [0.025, 0.975])
    assert low < 0.2 < high
    assert growth_check(found.draws).outcome == "note"
    assert not calibrate(case, adapt_noise=False, **SHORT).effects
    share = {"heteroscedastic_noise.share": Prior("fixed", (0.0,))}
    decided = replace(case.gear, effect_priors=share)
    assert not calibrate(replace(case, gear=decided), **SHORT).effects
