"""Bands: what they hold, where they are tested, and what they refuse."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from posteriors import (
    batch,
    plain_draws,
    single,
    written_posterior,
)
from rigs import cycles, make_case, make_records

from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.prediction.bands.predict import default_bands, predict
from hdcal.prediction.conditions import is_tested


def reading(records, seed=0):
    noise = np.random.default_rng(seed).normal(0.0, 0.4, len(records.force))
    slope = 205.0 * (1.0 - 3e-4 * (np.asarray(records.temperature) - 20.0))
    friction = 2.0 * np.asarray(records.sense)
    return slope * np.asarray(records.deformation) - 1.0 + friction + noise


@pytest.fixture(scope="module")
def rubbing():
    """Draws about the truth of the readings, with a friction of 2 N."""
    records = cycles(96)
    case = make_case(replace(records, force=reading(records)))
    draws = plain_draws(case, 400) | {"sigma": np.full(400, 0.4)}
    draws["coulomb_friction.force"] = np.full(400, 2.0)
    return written_posterior(case, draws, effects=["coulomb_friction"])


def test_bands_follow_deformation_temperature_and_direction(rubbing):
    up, down = (predict(rubbing, [0.1, 0.4], [20.0, 80.0], w) for w in ("up", "down"))
    assert list(up.deformation_mm) == [0.1, 0.4, 0.1, 0.4]
    assert list(up.temperature_C) == [20.0, 20.0, 80.0, 80.0]
    loop = up.physics_median_N - down.physics_median_N
    assert loop == pytest.approx(4.0, abs=0.5)
    drop = up.physics_median_N[1] - up.physics_median_N[3]
    assert drop == pytest.approx(205 * 0.4 * 3e-4 * 60, abs=0.5)
    true = 205.0 * 0.4 - 1.0 + 2.0
    assert up.physics_lo_N[1] < true < up.physics_hi_N[1]
    assert up.mean_N.median == up.physics_median_N[0]


def test_a_new_reading_has_the_quantiles_of_the_mixture():
    """Noise of each draw, and the rounding of the rig."""
    posterior = single(size=4000)
    gear = replace(posterior.case.gear, force_resolution=0.98)
    draws = {n: v for n, v in posterior.draws.items() if n != "noise_correlation"}
    rounded = written_posterior(replace(posterior.case, gear=gear), draws)
    for one, step in ((posterior, 0.0), (rounded, 0.98)):
        found, rng = predict(one, [0.3]), np.random.default_rng(1)
        mean = draws["stiffness"] * (0.3 - draws["deformation_offset"])
        mean = (mean + draws["force_offset"])[:, None]
        force = mean + draws["sigma"][:, None] * rng.normal(size=(4000, 100))
        force = force + step * rng.uniform(-0.5, 0.5, force.shape)
        low, high = np.quantile(force, [0.025, 0.975])
        assert found.new_measurement_lo_N[0] == pytest.approx(low, abs=0.08)
        assert found.new_measurement_hi_N[0] == pytest.approx(high, abs=0.08)
    half = predict(posterior, [0.3], interval=0.5)
    ends = np.quantile(mean, [0.25, 0.75])
    assert half.physics_lo_N[0] == pytest.approx(ends[0], abs=0.05)
    assert half.physics_hi_N[0] == pytest.approx(ends[1], abs=0.05)


def test_a_new_reading_is_on_a_new_mounting_and_gear():
    posterior = batch()
    none = {
        name: 0.0 * posterior.draws[name] for name in ("run_offset_sd", "specimen_sd")
    }

    def width(*scatter: str) -> float:
        still = {name: zero for name, zero in none.items() if name not in scatter}
        draws = posterior.draws | still
        found = predict(written_posterior(posterior.case, draws), [0.3])
        return (found.new_measurement_hi_N - found.new_measurement_lo_N)[0]

    of_run, of_gear = (
        np.sqrt(width(name) ** 2 - width() ** 2) / (2.0 * 1.96) for name in none
    )
    # The mean of six runs is uncertain too: a sixth of the variance more.
    assert of_run == pytest.approx(np.sqrt(7.0 / 6.0), rel=0.1)
    assert of_gear > 0.05 * 205.0 * 0.3


def test_tested_means_inside_the_data(rubbing):
    found = predict(rubbing, [0.01, 0.3, 0.6], [20.0, 90.0])
    assert list(found.tested) == [False, True, False, False, False, False]
    assert found.untested == 5
    assert found.beyond_tested == pytest.approx(0.06 / 0.52)
    loading_only = make_records(np.linspace(0.0, 0.5, 9))
    for sense, inside in ((1.0, True), (-1.0, False)):
        found = is_tested(loading_only, deformation=0.3, temperature=20.0, sense=sense)
        assert bool(found) == inside


def test_default_bands_reach_a_tenth_beyond_each_tested_direction(rubbing):
    found = default_bands(rubbing)
    assert {*found.direction} == {"up", "down"}
    assert {*found.temperature_C} == {20.0, 50.0, 80.0}
    assert found.deformation_mm.max() == pytest.approx(1.1 * 0.54)
    assert found.tested.any() and not found.tested.all()
    assert len(found.straight_N) == len(found.tested)


@pytest.mark.parametrize(
    "asked",
    [
        {"deformation": []},
        {"deformation": [np.nan]},
        {"deformation": {"deformation_mm": [0.3]}},
        {"deformation": [400.0]},
        {"temperature": [-300.0]},
        {"temperature": []},
        {"temperature": ["warm"]},
        {"direction": "sideways"},
        {"interval": 1.0},
        {"seed": -1},
    ],
    ids=str,
)
def test_bad_requests_are_refused_by_their_field(rubbing, asked):
    with pytest.raises(InputError) as refused:
        predict(rubbing, **{"deformation": [0.1], **asked})
    found = [finding.where for finding in refused.value.findings]
    assert found == [*asked] and {*asked} <= {*signature(predict).parameters}


def test_a_failed_posterior_predicts_nothing(rubbing):
    failed = replace(rubbing, checks=(Check("made to fail", "failed", "on purpose"),))
    with pytest.raises(NotUsable, match="made to fail"):
        predict(failed, [0.1])
    assert not default_bands(failed).usable.any()
