"""Noise is correlated or grows where readings do so, and the answers allow for it."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from rigs import autoregression, draw_truth, make_case, make_gear, make_records
from scipy import stats
from stated_density import base_places, off_the_stated_density
from structures import form_of

from hdcal.calibration.calibrate import calibrate
from hdcal.data.priors import Prior, effect_priors
from hdcal.data.reading import read_case
from hdcal.inference import model
from hdcal.inference import noise_form as noise_form_module
from hdcal.inference.checks import correlation_check, growth_check
from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.noise_form import growth_p_value, noise_grows, pilot_fit
from hdcal.inference.problem import build_problem
from hdcal.inference.residuals import noise_warnings
from hdcal.inference.serial_correlation import CORRELATION, previous_rows, whiten
from hdcal.inference.structure import NONE_SHOWN, decide_structure
from hdcal.inference.values import stiffness
from hdcal.physics.effect import Noise, Rows, parameters
from hdcal.physics.registry import EFFECTS

GROWS = EFFECTS["heteroscedastic_noise"]
SLOPE, ROWS = 205.0, 60
X = np.linspace(0.02, 0.54, ROWS)
SHORT = {"chains": 2, "warmup": 300, "draws": 300}


def case_of(noise, *, x=X, gear=None, **columns):
    return make_case(make_records(x, SLOPE * x - 1.0 + noise, **columns), gear)


@pytest.fixture(scope="module")
def both_forms():
    """Correlated noise that grows, and places in the sampler's coordinates."""
    rng = np.random.default_rng(0)
    case = case_of(rng.normal(size=ROWS))
    form = form_of(case, (GROWS,))
    problem = build_problem(case, effect_priors(), (GROWS,), structure=form)
    noise = f"{GROWS.name}.share"
    names = ["E0", "K", "alpha", "force_offset", "deformation_offset", "sigma"]
    places = {
        **base_places(rng),
        "deformation_offset": 0.02 * rng.normal(size=8),
        "_noise_sd": rng.normal(size=8),
        CORRELATION: rng.normal(size=8),
        "_noise_growth": 3.0 * rng.normal(size=8),
    }
    return problem, [*names, CORRELATION, noise], places


def test_coordinates_of_the_noise_have_the_stated_density(both_forms):
    np.testing.assert_allclose(off_the_stated_density(*both_forms), 0.0, atol=1e-4)


def test_a_coordinate_that_forgets_its_scale_is_told(both_forms, monkeypatch):
    real = model._scaled_and_moved
    monkeypatch.setattr(
        model,
        "_scaled_and_moved",
        lambda name, prior, scale, by: real(name, prior, 1.1 * scale, by),
    )
    jax.clear_caches()
    found = off_the_stated_density(*both_forms)
    jax.clear_caches()
    assert np.abs(found).max() > 0.1


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


def reason(case, effects=(), with_gap=False) -> str:
    found = decide_structure(case, effects, with_gap)
    assert found.correlated == (not found.why_independent)
    return found.why_independent


@pytest.mark.parametrize("wild", [6.0, 60.0])
def test_wild_readings_do_not_hide_that_the_others_are_rounded(wild):
    """The sd of all is above what Sheppard's correction asks, that of most is not."""
    noise = np.random.default_rng(0).normal(0.0, 0.3, ROWS)
    noise[::10] += np.tile([wild, -wild], ROWS // 20)
    case = case_of(np.round(noise, 1), gear=make_gear(resolution=0.5))
    assert 0.5 * pilot_fit(case.records).noise_sd > 0.5
    plain, mixed = (
        decide_structure(case, effects).rounded
        for effects in ((), (EFFECTS["outliers"],))
    )
    assert mixed and not plain


def test_why_no_correlation_is_asked_for_is_said():
    noise = np.random.default_rng(0).normal(0.0, 0.6, ROWS)
    none = make_gear(noise_correlation=Prior("fixed", (0.0,)))
    alike = autoregression(noise, 0 * X, 0.7)
    assert reason(case_of(alike)) == ""
    assert reason(case_of(noise)) == NONE_SHOWN
    assert "mixture" in reason(case_of(noise), (EFFECTS["outliers"],))
    assert "follows" in reason(case_of(noise, run=np.arange(ROWS)))
    assert "steps" in reason(case_of(noise, gear=make_gear(resolution=0.98)))
    assert "prior" in reason(case_of(noise, gear=none))


def test_none_seen_is_said_only_where_it_was_looked_for():
    seen = correlation_check({CORRELATION: np.full((2, 50), 0.01)}, 60)
    assert seen.outcome == "passed" and "no correlation" in seen.words
    some = correlation_check({CORRELATION: np.full((2, 50), 0.4)}, 60)
    assert some.outcome == "note" and "allows for it" in some.words
    strong = {CORRELATION: np.full((2, 50), 0.8)}
    few, many = (correlation_check(strong, rows) for rows in (60, 600))
    assert few.outcome == "warning" and "some 8 independent ones" in few.words
    assert many.outcome == "note"
    unasked = correlation_check({}, 60, "the steps are wide")
    assert unasked.outcome == "note"
    assert unasked.words.endswith("not inferred for these data: the steps are wide")


def test_a_correlation_held_at_none_is_independent_noise():
    """The density is that of least squares; any other correlation is another one."""
    noise = np.random.default_rng(0).normal(0.0, 0.6, ROWS)
    found = {}
    for rho in (0.0, 0.5):
        gear = make_gear(noise_correlation=Prior("fixed", (rho,)))
        case = case_of(noise, gear=gear)
        problem = build_problem(case, effect_priors(), structure=form_of(case))
        values = draw_truth(problem, jax.random.key(1)) | {"sigma": np.float64(0.6)}
        found[rho] = float(log_likelihood(problem, values))
        mean = stiffness(problem, values) * (X - values["deformation_offset"])
        mean = mean + values["force_offset"]
        error = np.asarray(case.records.force) - mean
        alone = stats.norm.logpdf(error, 0.0, 0.6).sum()
        assert (found[rho] == pytest.approx(alone, rel=1e-9)) == (rho == 0.0)


@pytest.fixture(scope="module")
def alike():
    noise = autoregression(np.random.default_rng(3).normal(size=ROWS), 0 * X, 0.7)
    case = case_of(0.6 * noise)
    held = make_gear(noise_correlation=Prior("fixed", (0.0,)))
    # A bend would take the place of the correlation that is held at none.
    how = {"with_gap": False, **SHORT}
    return [calibrate(one, **how) for one in (case, case_of(0.6 * noise, gear=held))]


@pytest.mark.thorough
def test_correlated_noise_widens_what_it_should(alike):
    found, independent = alike
    low, high = np.quantile(found.draws[CORRELATION], [0.025, 0.975])
    assert low < 0.7 < high and low > 0.2
    wide, narrow = (np.std(one.draws["stiffness"]) for one in alike)
    # Of a line through 60 readings: √((1 + ρ)/(1 − ρ)) times, less what ρ may be.
    assert 1.5 < wide / narrow < 3.5
    assert correlation_check(found.draws, ROWS).outcome == "warning"
    assert any("independent ones" in words for words in noise_warnings(found))
    assert not any("independent ones" in words for words in noise_warnings(independent))
    told = {check.name: check for check in independent.checks}
    found = told["neighbouring readings err independently"]
    assert found.outcome == "note" and CORRELATION not in independent.draws
    assert "not inferred" in found.words and "its prior says" in found.words


def test_noise_of_one_size_is_seldom_let_grow():
    rng = np.random.default_rng(1)
    for rows, most in ((14, 0.12), (120, 0.08)):
        x = np.linspace(0.02, 0.54, rows)
        grown = [noise_grows(case_of(rng.normal(size=rows), x=x)) for _ in range(400)]
        assert np.mean(grown) < most


def test_correlated_noise_of_one_size_is_seldom_let_grow(monkeypatch):
    rng, x = np.random.default_rng(2), np.linspace(0.02, 0.54, 200)

    def grown(scale) -> float:
        cases = (
            case_of(scale * autoregression(rng.normal(size=200), 0 * x, 0.8), x=x)
            for _ in range(300)
        )
        return float(np.mean([noise_grows(case) for case in cases]))

    assert grown(1.0) < 0.1
    assert grown(1.0 + 2.0 * x / x.max()) > 0.9
    # Taken for independent it passes for growth.
    monkeypatch.setattr(noise_form_module, "_MOST_ALIKE", 0.0)
    assert grown(1.0) > 0.12


def test_of_many_rows_a_trace_of_growth_is_none():
    rng, x = np.random.default_rng(3), np.linspace(0.02, 0.54, 100_000)
    for growth, seen in ((0.03, False), (0.3, True)):
        sd = 0.6 * (1.0 + growth * x / x.max())
        case = case_of(sd * rng.normal(size=len(x)), x=x)
        assert growth_p_value((sd * rng.normal(size=len(x))) ** 2, x) < 0.01
        assert noise_grows(case) is seen


def test_what_a_loop_leaves_at_its_turns_does_not_grow(monkeypatch):
    """Six gears that stick before they slip, of noise that is the same everywhere."""
    up, rng = np.linspace(0.0, 0.6, 14), np.random.default_rng(4)
    path = np.concatenate([up, up[-2::-1]])
    stuck, loop = 0.0, []
    for step in np.diff(path, prepend=0.0):
        stuck = np.clip(stuck + 22.0 * step, -1.5, 1.5)
        loop.append(stuck)
    rows = {
        "known": {"unloading"},
        "run": np.repeat(np.arange(6), len(path)),
        "sense": np.tile(np.where(np.arange(len(path)) < len(up), 1.0, -1.0), 6),
    }

    def grown(share=0.0) -> float:
        sd = 0.3 + share * np.tile(path, 6)
        noises = (sd * rng.normal(size=len(sd)) for _ in range(200))
        cases = (
            case_of(np.tile(loop, 6) + e, x=np.tile(path, 6), **rows) for e in noises
        )
        return float(np.mean([noise_grows(case) for case in cases]))

    assert grown() < 0.08
    assert grown(0.5) > 0.8
    # Where the loop is not looked for it passes for growth.
    plain = noise_form_module.pilot_fit
    monkeypatch.setattr(
        noise_form_module, "pilot_fit", lambda records, **_: plain(records)
    )
    assert grown() > 0.5


def test_growth_that_the_range_cannot_show_is_not_asked_for(monkeypatch):
    """Noise in proportion to a deformation that hardly changes does not grow."""
    rng = np.random.default_rng(4)

    def grown() -> float:
        noises = [(X + 0.02) * rng.normal(size=ROWS) for _ in range(50)]
        return float(np.mean([noise_grows(case_of(e, x=X + 10.0)) for e in noises]))

    assert grown() == 0.0
    monkeypatch.setattr(noise_form_module, "_LEAST_GROWTH", 1.001)
    assert grown() > 0.5


def test_growing_noise_is_sampled_where_forces_are_large():
    rng = np.random.default_rng(3)
    x = np.linspace(4.5, 18.0, 21)
    force = 40e3 * x - 1.2e6 + 8e3 * rng.normal(size=21)
    case = read_case({"displacement_mm": x, "force_N": force})
    found = calibrate(case, effects=(GROWS.name,))
    assert found.usable
    line = stats.linregress(x, force)
    middle = np.median(found.draws["stiffness"])
    assert middle == pytest.approx(line.slope, abs=line.stderr)


@pytest.mark.thorough
def test_noise_in_proportion_to_the_force_is_let_grow():
    rng = np.random.default_rng(2)
    share = [noise_grows(case_of(0.2 * SLOPE * X * rng.normal(size=ROWS))) for _ in X]
    assert np.mean(share) > 0.85
    case = case_of(0.2 * SLOPE * X * rng.normal(size=ROWS))
    found = calibrate(case, **SHORT)
    assert [effect.name for effect in found.effects] == ["heteroscedastic_noise"]
    low, high = np.quantile(found.draws["heteroscedastic_noise.share"], [0.025, 0.975])
    assert low < 0.2 < high
    # Without a constant part every reading is above zero, and σ near none a wall.
    for _ in range(3):
        again = case_of(0.2 * SLOPE * X * rng.normal(size=ROWS))
        assert calibrate(again, chains=2, warmup=300, draws=1000).usable
    own = Prior("lognormal", (0.5, 1.6), "N", "of my rig")
    mine = replace(case.gear, priors={**case.gear.priors, "sigma": own})
    kept = calibrate(replace(case, gear=mine), **SHORT)
    assert kept.case.gear.priors["sigma"] == own != found.case.gear.priors["sigma"]
    for unasked in (found, kept):
        (told,) = [c.words for c in unasked.checks if "of the force" in c.words]
        words = case.units.say(growth_check(unasked.draws).words)
        assert words in told and "--constant-noise" in told
    assert not calibrate(case, adapt_noise=False, **SHORT).effects
    share = {"heteroscedastic_noise.share": Prior("fixed", (0.0,))}
    decided = replace(case.gear, effect_priors=share)
    assert not calibrate(replace(case, gear=decided), **SHORT).effects
