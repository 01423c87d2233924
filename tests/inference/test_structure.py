"""Correlation and bend are in the model where the readings show them, else not."""

from dataclasses import replace

import numpy as np
import pytest

import hdcal
from hdcal.data.prior import Prior
from hdcal.inference.noise_form import pilot_fit
from hdcal.inference.structure import ModelStructure, decide_structure
from hdcal.physics.registry import EFFECTS

ROWS = 200
SPRING = {
    "name": "spring",
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def case(bend: float, correlation: float, seed: int, rows: int = ROWS) -> hdcal.Case:
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=rows)
    for row in range(1, rows):
        own = np.sqrt(1.0 - correlation**2) * noise[row]
        noise[row] = correlation * noise[row - 1] + own
    x = np.linspace(0.0, 1.0, rows)
    y = 100.0 * x + bend * (2.0 * x - 1.0) ** 2 + noise
    return hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=SPRING)


def form(bend: float, correlation: float, seed: int) -> tuple[bool, bool]:
    found = decide_structure(case(bend, correlation, seed))
    return found.correlated, found.with_gap


@pytest.mark.parametrize("correlation", [0.0, 0.7])
@pytest.mark.parametrize("bend", [0.0, 5.0])
def test_the_form_is_that_of_the_simulated_readings(bend: float, correlation: float):
    right = sum(
        form(bend, correlation, seed) == (correlation > 0.0, bend > 0.0)
        for seed in range(20)
    )
    assert right >= 18


def test_correlation_is_of_what_is_faster_than_the_loading():
    # 200 rows of one ramp: neighbours may err alike over 40 rows.
    prior = case(0.0, 0.0, 0).gear.scale_priors["noise_correlation"]
    assert prior.numbers == pytest.approx((0.0, np.exp(-1.0 / 40.0)))


def test_a_bend_is_not_fitted_beside_effects_or_few_rows():
    bent = case(20.0, 0.0, 0)
    assert decide_structure(bent).with_gap
    assert not decide_structure(bent, [EFFECTS["progressive_stiffening"]]).with_gap
    assert not decide_structure(case(20.0, 0.0, 0, rows=40)).with_gap
    assert decide_structure(bent, [EFFECTS["hysteresis"]], with_gap=True).with_gap


def test_beside_a_bend_coarse_steps_may_hold_correlated_noise():
    """The steps are 0.7 noise sds: beside a bend they count as noise."""
    gear, step = {**SPRING, "force_resolution_N": 0.7}, 0.7
    for seed in range(5):
        bent = case(20.0, 0.8, seed).records
        force = np.round(np.asarray(bent.force) / step) * step
        table = {"deformation_mm": np.asarray(bent.deformation), "force_N": force}
        found = decide_structure(hdcal.read_case(table, gear=gear))
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


def test_a_posterior_keeps_its_structure():
    posterior = hdcal.calibrate(case(0.0, 0.7, 0), warmup=200, draws=200)
    assert posterior.structure == decide_structure(posterior.case)
    assert isinstance(posterior.structure, ModelStructure)
    assert posterior.structure.correlated and "noise_correlation" in posterior.draws


def test_a_correlation_that_the_gear_file_states_is_in_the_model():
    plain = case(0.0, 0.0, 0)
    assert not decide_structure(plain).correlated
    stated = Prior("beta", (20.0, 20.0))
    priors = plain.gear.scale_priors | {"noise_correlation": stated}
    gear = replace(plain.gear, scale_priors=priors)
    assert decide_structure(replace(plain, gear=gear)).correlated
