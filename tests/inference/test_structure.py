"""Correlation, bend and growth are in the model where the readings show them."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import autoregression, make_case, make_gear, make_records

import hdcal
from hdcal.data.prior import Prior
from hdcal.inference.force_model import noise_form
from hdcal.inference.force_model.noise_form import noise_grows, pilot_fit
from hdcal.inference.force_model.structure import (
    NONE_SHOWN,
    decide_structure,
)
from hdcal.physics.registry import EFFECTS

ROWS = 200
SPRING = {
    "name": "spring",
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def case(
    bend: float, correlation: float, seed: int, rows: int = ROWS, step: float = 0.0
) -> hdcal.Case:
    noise = np.random.default_rng(seed).normal(size=rows)
    noise = autoregression(noise, np.zeros(rows), correlation)
    x = np.linspace(0.0, 1.0, rows)
    y = 100.0 * x + bend * (2.0 * x - 1.0) ** 2 + noise
    gear = SPRING
    if step:
        y, gear = np.round(y / step) * step, {**SPRING, "force_resolution_N": step}
    return hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=gear)


@pytest.mark.parametrize("correlation", [0.0, 0.7])
@pytest.mark.parametrize("bend", [0.0, 5.0])
def test_the_form_is_that_of_the_simulated_readings(bend: float, correlation: float):
    right = 0
    for seed in range(20):
        found = decide_structure(case(bend, correlation, seed))
        form = found.correlated, found.with_gap
        right += form == (correlation > 0.0, bend > 0.0)
    assert right >= 18


def test_a_bend_is_not_fitted_with_effects_or_few_rows():
    bent = case(20.0, 0.0, 0)
    assert decide_structure(bent).with_gap
    assert not decide_structure(bent, [EFFECTS["progressive_stiffening"]]).with_gap
    assert not decide_structure(case(20.0, 0.0, 0, rows=40)).with_gap
    assert decide_structure(bent, [EFFECTS["hysteresis"]], with_gap=True).with_gap


def test_with_a_bend_coarse_steps_may_hold_correlated_noise():
    """The steps are 0.7 noise sds: with a bend they count as noise."""
    for seed in range(5):
        found = decide_structure(case(20.0, 0.8, seed, step=0.7))
        assert found.with_gap and found.correlated and not found.rounded


def test_many_specimens_have_a_line_each():
    """The noise is that about sixty lines, and not the scatter of the slopes."""
    rng, gears, rows = np.random.default_rng(4), 60, 20
    x = np.tile(np.linspace(0.0, 1.0, rows), gears)
    slopes = np.repeat(rng.normal(100.0, 10.0, gears), rows)
    table = {"deformation_mm": x, "force_N": slopes * x + rng.normal(size=x.size)}
    table["specimen"] = np.repeat(np.arange(gears), rows).astype(str)
    many = hdcal.read_case(table, gear=SPRING)
    assert pilot_fit(many.records).noise_sd == pytest.approx(1.0, rel=0.06)
    assert not decide_structure(many).with_gap


X = np.linspace(0.02, 0.54, 60)
NOISE = np.random.default_rng(0).normal(0.0, 0.6, 60)


def case_of(noise, *, x=X, gear=None, **columns):
    return make_case(make_records(x, 205.0 * x - 1.0 + noise, **columns), gear)


@pytest.mark.parametrize(
    ("build", "effects", "reason"),
    [
        (lambda: case_of(autoregression(NOISE, 0 * X, 0.7)), (), ""),
        (lambda: case_of(NOISE), (), NONE_SHOWN),
        (lambda: case_of(NOISE), ("outliers",), "mixture"),
        (lambda: case_of(NOISE, run=np.arange(60)), (), "follows"),
        (lambda: case_of(NOISE, gear=make_gear(resolution=0.98)), (), "steps"),
        (
            lambda: case_of(
                NOISE, gear=make_gear(noise_correlation=Prior("fixed", (0.0,)))
            ),
            (),
            "prior",
        ),
    ],
)
def test_the_reason_for_no_correlation_is_kept(build, effects, reason):
    effects = [EFFECTS[name] for name in effects]
    found = decide_structure(build(), effects, with_gap=False)
    assert reason in found.why_independent
    assert found.correlated == (not found.why_independent)


def test_a_correlation_that_the_gear_file_states_is_in_the_model():
    stated = make_gear(noise_correlation=Prior("beta", (20.0, 20.0)))
    assert decide_structure(case_of(NOISE, gear=stated)).correlated


@pytest.mark.parametrize("wild", [6.0, 60.0])
def test_wild_readings_do_not_hide_that_the_others_are_rounded(wild):
    """The sd of all is above what Sheppard's correction needs, that of most is not."""
    noise = 0.5 * NOISE
    noise[::10] += np.tile([wild, -wild], 3)
    rounded = case_of(np.round(noise, 1), gear=make_gear(resolution=0.5))
    assert 0.5 * pilot_fit(rounded.records).noise_sd > 0.5
    assert not decide_structure(rounded).rounded
    assert decide_structure(rounded, (EFFECTS["outliers"],)).rounded


def share_grown(noise_of, x=X, count: int = 150, **rows) -> float:
    cases = (case_of(noise_of(), x=x, **rows) for _ in range(count))
    return float(np.mean([noise_grows(one) for one in cases]))


def test_correlated_noise_of_one_size_rarely_grows(monkeypatch):
    rng, x = np.random.default_rng(2), np.linspace(0.02, 0.54, 200)

    def grown(scale) -> float:
        return share_grown(
            lambda: scale * autoregression(rng.normal(size=200), 0 * x, 0.8), x
        )

    assert grown(1.0) < 0.1
    assert grown(1.0 + 2.0 * x / x.max()) > 0.9
    # Taken for independent it passes for growth.
    monkeypatch.setattr(noise_form, "_LARGEST_CORRELATION", 0.0)
    assert grown(1.0) > 0.12


def test_what_a_loop_leaves_at_its_turns_does_not_grow(monkeypatch):
    """Six gears that stick before they slip, of noise that is the same everywhere."""
    up, rng = np.linspace(0.0, 0.6, 14), np.random.default_rng(4)
    path = np.concatenate([up, up[-2::-1]])
    stuck, loop = 0.0, []
    for step in np.diff(path, prepend=0.0):
        stuck = np.clip(stuck + 22.0 * step, -1.5, 1.5)
        loop.append(stuck)
    place = np.tile(path, 6)
    rows = {
        "known": {"unloading"},
        "run": np.repeat(np.arange(6), len(path)),
        "sense": np.tile(np.where(np.arange(len(path)) < len(up), 1.0, -1.0), 6),
    }

    def grown(share=0.0) -> float:
        sd = 0.3 + share * place
        return share_grown(
            lambda: np.tile(loop, 6) + sd * rng.normal(size=len(sd)), place, **rows
        )

    assert grown() < 0.08
    assert grown(0.5) > 0.8
    # Where the loop is not fitted it passes for growth.
    plain = noise_form.fit_lines
    monkeypatch.setattr(noise_form, "fit_lines", lambda records, _: plain(records))
    assert grown() > 0.5


@pytest.mark.thorough
def test_noise_in_proportion_to_the_force_is_in_the_model():
    rng, size = np.random.default_rng(2), {"chains": 2, "warmup": 300, "draws": 1000}
    grown = case_of(41.0 * X * rng.normal(size=60))
    found = hdcal.calibrate(grown, **size)
    assert found.usable
    assert [effect.name for effect in found.effects] == ["heteroscedastic_noise"]
    low, high = np.quantile(found.draws["heteroscedastic_noise.share"], [0.025, 0.975])
    assert low < 0.2 < high
    stated = Prior("lognormal", (0.5, 1.6), "N", "of my rig")
    gear = replace(grown.gear, priors={**grown.gear.priors, "sigma": stated})
    kept = hdcal.calibrate(replace(grown, gear=gear), **size)
    assert kept.case.gear.priors["sigma"] == stated != found.priors["sigma"]
    assert not hdcal.calibrate(grown, adapt_noise=False, **size).effects
    none = {"heteroscedastic_noise.share": Prior("fixed", (0.0,))}
    gear = replace(grown.gear, effect_priors=none)
    assert not hdcal.calibrate(replace(grown, gear=gear), **size).effects
