"""A moving gear's mass, damping and stiffness are found, or it is said why not."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from moving import TRUTH, motion, moving_case, moving_gear, write_moving
from rigs import make_records
from schema_checks import obeys
from scipy.stats import chi2
from short import SHORT

from hdcal import InputError, NotUsable, Prior, calibrate_dynamic, predict, respond
from hdcal.__main__ import main
from hdcal.inference.checks import Check
from hdcal.inference.model_average import load_models
from hdcal.motion import dynamic_calibration as calibration
from hdcal.motion.answer import DynamicCalibrationAnswer
from hdcal.motion.bands import motion_bands
from hdcal.motion.dynamic_calibration import highest_peak
from hdcal.motion.dynamic_posterior import DynamicPosterior
from hdcal.motion.dynamic_priors import dynamic_site_priors
from hdcal.motion.dynamic_problem import build_dynamic
from hdcal.motion.summary import dynamic_answer
from hdcal.physics.linear_response import LinearGear, linear_response
from hdcal.report.plain import as_json

# One shape and one length for all: the sampler is compiled once.
# Of 500 draws the R-hat of some tail is above its limit in one run of ten.
SETTINGS = {"chains": 4, "effects": (), **SHORT, "draws": 1000}
SOUGHT = ("mass", "damping", "stiffness")
# False-alarm probability of each statistical test; the seeds are fixed.
LEVEL = 1e-3


def certain(value: float) -> Prior:
    """Return a prior that lets no data speak: fixed, but of a sampled family."""
    return Prior("lognormal", (value, 1e-3))


@cache
def calibrated(seed: int):
    """Return a calibration under the shipped priors."""
    return calibrate_dynamic(moving_case(seed), **SETTINGS)


def recovered(seeds, **priors) -> tuple[dict[str, int], float]:
    """Return in how many seeds each truth lies inside its 95 % interval.

    And the p value of how far from the truths the posteriors lie: the sum of squared
    distances, each in the sds and correlations of its posterior, is a χ² or less.
    """
    count, distance = dict.fromkeys(SOUGHT, 0), 0.0
    for seed in seeds:
        case = moving_case(seed, moving_gear(**priors))
        found = calibrate_dynamic(case, **SETTINGS) if priors else calibrated(seed)
        draws = np.stack([found.draws[name] for name in SOUGHT])
        truth = np.array(motion(TRUTH, case))
        low, high = np.quantile(draws, [0.025, 0.975], axis=1)
        for name, inside in zip(SOUGHT, (low <= truth) & (truth <= high), strict=True):
            count[name] += int(inside)
        off = truth - draws.mean(axis=1)
        distance += off @ np.linalg.solve(np.cov(draws), off)
    return count, float(chi2.sf(distance, len(SOUGHT) * len(seeds)))


@pytest.mark.thorough
def test_a_few_seeds_are_recovered():
    count, p = recovered(range(4))
    # All but one: with 95 % intervals fewer come once in 30 parameters.
    assert min(count.values()) >= 3, count
    assert p > LEVEL


@pytest.mark.thorough
def test_noise_taken_too_small_is_told_by_the_distance():
    small = certain(0.3 * TRUTH["deformation_sigma"])
    _, p = recovered(range(4), deformation_sigma=small)
    assert p < LEVEL


@pytest.mark.thorough
def test_a_mass_taken_too_large_is_told_by_the_same_count():
    count, p = recovered(range(2), mass=certain(1.2 * TRUTH["mass"]))
    assert count["mass"] == count["stiffness"] == 0, count
    assert p < LEVEL


@pytest.mark.slow
def test_fifty_seeds_are_recovered():
    count, p = recovered(range(50))
    assert min(count.values()) >= 45, count
    assert p > LEVEL


@pytest.fixture(scope="module")
def posterior():
    """One good calibration."""
    return calibrated(0)


def outcome(posterior, name: str) -> str:
    """Return what a check found."""
    return next(check.outcome for check in posterior.checks if check.name == name)


def test_a_good_record_passes(posterior):
    assert posterior.usable, posterior.reasons
    assert outcome(posterior, "residuals are noise") == "passed"
    drivers = {name: d.driven_by for name, d in posterior.diagnoses.items()}
    assert drivers["mass"] == drivers["damping_ratio"] == "data"
    assert drivers["alpha"] == drivers["E0"] == "prior"


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_draws_and_a_file_gives_them_back(
    posterior, tmp_path
):
    again = calibrate_dynamic(moving_case(0), **SETTINGS)
    assert np.array_equal(again.draws["mass"], posterior.draws["mass"])
    posterior.save(tmp_path / "posterior.nc")
    loaded = load_models(tmp_path, [DynamicPosterior])
    assert isinstance(loaded, DynamicPosterior)
    assert np.array_equal(loaded.draws["mass"], posterior.draws["mass"])
    assert as_json(dynamic_answer(loaded)) == as_json(dynamic_answer(posterior))
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


@pytest.mark.thorough
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


@pytest.mark.parametrize(
    ("columns", "labels", "words"),
    [
        ({"known": frozenset()}, {}, "no column holds the time"),
        ({"time": np.repeat(np.arange(100.0), 2)}, {}, "not later than"),
        ({"force_sd": np.full(200, 0.5)}, {}, "gives an sd of the force"),
        ({}, {"run_labels": ("1", "2")}, "several runs"),
    ],
)
def test_what_is_no_time_series_is_refused(columns, labels, words):
    case = moving_case(0)
    spoiled = replace(case, records=replace(case.records, **columns), **labels)
    with pytest.raises(InputError, match=words):
        calibrate_dynamic(spoiled)


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


def ambiguous():
    """Return a faint swing after a blow: noise has as much to say as the gear."""
    time = np.arange(200) / 4000.0
    force = np.zeros(200)
    force[0] = 30.0
    gear = LinearGear(4e-5, 2e-3, 195.0)
    clean = linear_response(gear, time, force, np.zeros(2))[:, 0]
    read = np.asarray(clean) + np.random.default_rng(3).normal(0.0, 0.1, 200)
    records = make_records(read, force, known={"time"}, time=time)
    return replace(moving_case(0), records=records)


def test_frequencies_that_fit_alike_fail_the_result():
    for case, expected in ((ambiguous(), "failed"), (moving_case(0), "passed")):
        problem = build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")
        assert highest_peak(problem)[1].outcome == expected


@pytest.fixture(scope="module")
def failed(posterior):
    """The same calibration, had one of its checks failed."""
    return replace(posterior, checks=(Check("by hand", "failed", "told to"),))


def test_nothing_follows_from_a_failed_one(failed):
    assert dynamic_answer(failed).status == "failed"
    assert not motion_bands(failed).usable.any()
    with pytest.raises(NotUsable, match="told to"):
        respond(failed, "step")


@pytest.mark.parametrize("code", [0, 1])
def test_the_command_writes_what_the_library_found(
    code, posterior, failed, tmp_path, capsys, monkeypatch
):
    found = [posterior, failed][code]
    monkeypatch.setattr(calibration, "calibrate_dynamic", lambda *_, **__: found)
    folder = write_moving(moving_case(0), tmp_path / "released")
    out = tmp_path / "result"
    given = ["calibrate", "--dynamic", str(folder), "--out", str(out), "--json"]
    with pytest.raises(SystemExit) as ended:
        main(given)
    assert ended.value.code == code
    summary = json.loads(capsys.readouterr().out)
    assert summary == json.loads((out / "summary.json").read_text("utf-8"))
    obeys(summary, DynamicCalibrationAnswer)
    assert summary["schema"] == "hdcal.dynamic-calibration/1"
    assert summary["status"] == ["ok", "failed"][code]
    names = {"motion.csv", "motion.png", "motion.svg", "posterior.nc", "report.html"}
    names |= {"summary.json", "hdcal-result.json"}
    assert {file.name for file in out.iterdir()} == names
    page = (out / "report.html").read_text("utf-8")
    marked = "FAILED — do not use" in page
    assert marked == (code == 1)
    assert ("FAILED" in (out / "motion.svg").read_text("utf-8")) == marked
