"""A calibration of a moving gear says what it cannot know, and when not to be used."""

from dataclasses import replace

import numpy as np
import pytest
from moving import moving_case
from rigs import make_records

from hdcal import InputError, calibrate_dynamic, predict
from hdcal.answers.dynamics.summary import motion_bands, summarise_dynamic
from hdcal.inference.dynamic.posterior import DynamicPosterior, load_any
from hdcal.physics.linear_response import linear_response

SETTINGS = {"chains": 4, "warmup": 400, "draws": 500}


@pytest.fixture(scope="module")
def posterior():
    """One good calibration."""
    return calibrate_dynamic(moving_case(0), **SETTINGS)


def outcome(posterior, name: str) -> str:
    """Return what a check found."""
    return next(check.outcome for check in posterior.checks if check.name == name)


def test_a_good_record_passes(posterior):
    assert posterior.usable, posterior.reasons
    assert outcome(posterior, "residuals are noise") == "passed"
    drivers = {name: d.driven_by for name, d in posterior.diagnoses.items()}
    assert drivers["mass"] == drivers["damping_ratio"] == "data"
    assert drivers["alpha"] == drivers["E0"] == "prior"


def test_the_same_seed_gives_the_same_draws_and_a_file_gives_them_back(
    posterior, tmp_path
):
    again = calibrate_dynamic(moving_case(0), **SETTINGS)
    assert np.array_equal(again.draws["mass"], posterior.draws["mass"])
    posterior.save(tmp_path / "posterior.nc")
    loaded = load_any(tmp_path)
    assert isinstance(loaded, DynamicPosterior)
    assert np.array_equal(loaded.draws["mass"], posterior.draws["mass"])
    assert summarise_dynamic(loaded) == summarise_dynamic(posterior)
    assert loaded.case.gear.density == posterior.case.gear.density


def test_a_new_reading_lies_in_its_band_as_often_as_said(posterior):
    bands = motion_bands(posterior)
    other = moving_case(1).records.deformation
    inside = (other >= bands.new_measurement_lo_mm) & (
        other <= bands.new_measurement_hi_mm
    )
    # 200 readings: 95 % within three binomial sds.
    assert 0.90 <= inside.mean() <= 0.995


def test_no_force_is_predicted_from_it(posterior):
    with pytest.raises(InputError, match="moving gear"):
        predict(posterior, [0.1])


def test_a_gear_that_is_not_linear_is_told_by_its_residuals():
    case = moving_case(0)
    records = case.records
    # Its frequency falls by 3 % as the swing dies out.
    time = np.asarray(records.time)
    warped = time + 0.03 * np.maximum(time - 0.3 * time[-1], 0.0) ** 2 / time[-1]
    bent = np.interp(time, warped, records.deformation)
    found = calibrate_dynamic(
        replace(case, records=replace(records, deformation=bent)), **SETTINGS
    )
    assert outcome(found, "residuals are noise") == "warning"


def test_too_short_a_run_fails():
    found = calibrate_dynamic(moving_case(0), chains=2, warmup=2, draws=20)
    assert not found.usable
    assert summarise_dynamic(found)["status"] == "failed"
    assert not motion_bands(found).usable.any()


def spoiled(**changes):
    """Return a case with some columns replaced."""
    case = moving_case(0)
    return replace(case, records=replace(case.records, **changes))


@pytest.mark.parametrize(
    ("case", "words"),
    [
        (spoiled(known=frozenset()), "no column holds the time"),
        (spoiled(time=np.repeat(np.arange(100.0), 2)), "not later than"),
        (spoiled(temperature=np.linspace(20.0, 40.0, 200)), "runs over 20 K"),
        (spoiled(force_sd=np.full(200, 0.5)), "gives an sd of the force"),
        (replace(moving_case(0), run_labels=("1", "2")), "several runs"),
    ],
)
def test_what_is_no_time_series_is_refused(case, words):
    with pytest.raises(InputError, match=words):
        calibrate_dynamic(case)


def test_every_fault_is_told_at_once():
    short = make_records(np.linspace(0.0, 0.1, 8))
    case = replace(moving_case(0), records=short)
    with pytest.raises(InputError) as caught:
        calibrate_dynamic(case)
    assert len(caught.value.findings) == 2


def test_a_material_without_density_is_told():
    case = moving_case(0)
    with pytest.raises(InputError, match="no density"):
        calibrate_dynamic(replace(case, gear=replace(case.gear, density=None)))


def test_two_frequencies_that_fit_alike_fail():
    # Two rows a period: what swings at f and at its alias reads the same.
    case = moving_case(0)
    time = np.arange(40) / 4000.0
    rng = np.random.default_rng(3)
    force = np.zeros(40)
    force[0] = 30.0
    clean = linear_response(4e-5, 2e-3, 195.0, time, force, np.zeros(2))[:, 0]
    read = np.asarray(clean) + rng.normal(0.0, 0.05, 40)
    records = make_records(read, force, known={"time"}, time=time)
    found = calibrate_dynamic(replace(case, records=records), **SETTINGS)
    assert outcome(found, "one natural frequency explains the data") == "failed"
