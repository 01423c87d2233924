"""Mass, damping and stiffness of a moving gear are recovered, or a check warns."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from moving import TRUTH, frictional_case, motion, moving_case, moving_gear
from rigs import make_case, make_records
from schema_checks import obeys
from scipy.stats import chi2
from short import SHORT

from hdcal import InputError, NotUsable, Prior, calibrate_dynamic, predict, respond
from hdcal.inference import laplace
from hdcal.inference.checks import Check
from hdcal.inference.model_average import load_models
from hdcal.motion.dynamic_calibration import (
    DynamicCalibration,
    dynamic_calibration_of,
    whiteness_check,
)
from hdcal.motion.dynamic_problem import (
    DynamicPosterior,
    build_dynamic,
    dynamic_site_priors,
)
from hdcal.motion.mode_search import highest_peak
from hdcal.physics.linear_response import LinearGear, linear_response

# One shape and one length for all: the sampler is compiled once.
SETTINGS = {"chains": 4, **SHORT, "draws": 1000}
SOUGHT = ("mass", "damping", "stiffness")
# False-alarm probability of each statistical test; the seeds are fixed.
LEVEL = 1e-3
ROWS, ALPHA = 380, 5e-4


@cache
def calibrated(seed: int) -> DynamicPosterior:
    """Return a calibration under the shipped priors."""
    return calibrate_dynamic(moving_case(seed), **SETTINGS)


@pytest.fixture(scope="module")
def posterior() -> DynamicPosterior:
    return calibrated(0)


def linear_problem(case):
    return build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")


def recovered(seeds, **priors) -> tuple[dict[str, int], float]:
    """Return how many 95 % intervals hold each truth, and a p value of the distances.

    The sum of squared distances of the truths, each in the sds and correlations of its
    posterior, is a χ² or less.
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
@pytest.mark.parametrize(
    ("seeds", "least"), [(4, 3), pytest.param(20, 16, marks=pytest.mark.slow)]
)
def test_the_truth_is_recovered(seeds: int, least: int):
    count, p = recovered(range(seeds))
    assert min(count.values()) >= least and p > LEVEL, (count, p)


@pytest.mark.thorough
def test_a_wrong_prior_is_flagged_by_the_same_count():
    """Noise taken as 0.3 of its size, and a mass 20 % too large."""
    small = Prior("lognormal", (0.3 * TRUTH["deformation_sigma"], 1e-3))
    assert recovered(range(4), deformation_sigma=small)[1] < LEVEL
    heavy = Prior("lognormal", (1.2 * TRUTH["mass"], 1e-3))
    count, p = recovered(range(2), mass=heavy)
    assert count["mass"] == count["stiffness"] == 0 and p < LEVEL


def test_a_good_record_has_a_result_with_the_numbers_of_the_draws(posterior):
    assert posterior.usable, posterior.reasons
    drivers = {name: d.driven_by for name, d in posterior.diagnoses.items()}
    assert drivers["mass"] == drivers["damping_ratio"] == "data"
    assert drivers["alpha"] == drivers["E0"] == "prior"
    found = dynamic_calibration_of(posterior)
    obeys(found.to_dict(), DynamicCalibration)
    frequency = np.sqrt(195.0 / TRUTH["mass"]) / (2.0 * np.pi)
    assert found.natural_frequency_Hz.median == pytest.approx(frequency, rel=0.01)
    frame = found.to_frame().set_index("name")
    mass = 1e3 * np.median(posterior.draws["mass"])
    assert frame["median"]["mass"] == pytest.approx(mass)
    assert frame["unit"]["natural_frequency"] == "Hz"
    other = moving_case(1).records.deformation
    bands = found.bands
    inside = other >= bands.new_measurement_lo_mm
    inside &= other <= bands.new_measurement_hi_mm
    # 200 new readings: 95 % within three binomial sds.
    assert 0.90 <= inside.mean() <= 0.995
    assert (bands.mean_lo_mm >= bands.new_measurement_lo_mm).all()


@pytest.mark.thorough
def test_a_file_gives_back_the_draws_and_the_seed_the_same_ones(posterior, tmp_path):
    again = calibrate_dynamic(moving_case(0), **SETTINGS)
    assert np.array_equal(again.draws["mass"], posterior.draws["mass"])
    posterior.save(tmp_path / "posterior.nc")
    loaded = load_models(tmp_path, [DynamicPosterior])
    assert isinstance(loaded, DynamicPosterior)
    results = [dynamic_calibration_of(one).to_dict() for one in (loaded, posterior)]
    assert results[0] == results[1]


def test_a_failed_one_gives_no_force_and_no_motion(posterior):
    with pytest.raises(InputError, match="dynamic calibration"):
        predict(posterior, [0.1])
    failed = replace(posterior, checks=(Check("by hand", "failed", "told to"),))
    found = dynamic_calibration_of(failed)
    assert found.status == "failed" and not found.bands.usable.any()
    with pytest.raises(NotUsable, match="told to"):
        respond(failed, "step")


def shaken():
    """Return the case of a gear shaken at random while it warms by 20 K."""
    rng = np.random.default_rng(0)
    time = np.arange(ROWS) / 3000.0
    force = 60.0 + 25.0 * rng.normal(size=ROWS)
    warm = 20.0 + 20.0 * time / time[-1]
    columns = {"known": {"time", "temperature"}, "time": time, "temperature": warm}
    blank = make_case(make_records(np.zeros(ROWS), force, **columns), moving_gear())
    mean = motion(TRUTH, blank)
    rise = 0.5 * (warm[1:] + warm[:-1]) - blank.gear.reference_temperature
    softer = mean._replace(stiffness=mean.stiffness * (1.0 - ALPHA * rise))
    start = np.array([force[0] / mean.stiffness, 0.0])
    read = np.asarray(linear_response(softer, time, force, start))[:, 0]
    read = read + rng.normal(0.0, TRUTH["deformation_sigma"], ROWS)
    return make_case(make_records(read, force, **columns), blank.gear)


@pytest.mark.thorough
def test_a_record_that_warms_determines_alpha():
    found = calibrate_dynamic(shaken(), chains=2, **SHORT | {"draws": 1000})
    assert found.usable, found.reasons
    alpha = found.draws["alpha"]
    assert found.diagnoses["alpha"].driven_by == "data"
    assert abs(alpha.mean() - ALPHA) < 3.3 * alpha.std() < ALPHA


def test_frequencies_that_fit_alike_fail_the_result():
    """A faint swing after a blow: noise has as much to say as the gear."""
    time, force = np.arange(200) / 4000.0, np.zeros(200)
    force[0] = 30.0
    gear = LinearGear(4e-5, 2e-3, 195.0)
    clean = np.asarray(linear_response(gear, time, force, np.zeros(2)))[:, 0]
    read = clean + np.random.default_rng(3).normal(0.0, 0.1, 200)
    records = make_records(read, force, known={"time"}, time=time)
    faint = replace(moving_case(0), records=records)
    for case, expected in ((faint, "failed"), (moving_case(0), "passed")):
        assert highest_peak(linear_problem(case))[1].outcome == expected


def whiteness(problem, mode) -> str:
    return whiteness_check(problem, laplace.values_at(problem, mode.centre)).outcome


# Damping ratio and dry friction [N], and whether the linear model is flagged.
LOSSES = [(0.02, 0.0, False), (0.0, 2.0, True), (0.01, 1.0, True), (0.005, 4.0, True)]


@pytest.mark.parametrize(("ratio", "friction", "flagged"), LOSSES)
def test_dry_friction_is_flagged_by_the_residuals(ratio, friction, flagged):
    problem = linear_problem(frictional_case(100, ratio, friction))
    expected = "warning" if flagged else "passed"
    assert whiteness(problem, highest_peak(problem)[0]) == expected


@pytest.mark.parametrize(
    ("columns", "labels", "words"),
    [
        ({"known": frozenset()}, {}, "no column contains the time"),
        ({"time": np.repeat(np.arange(100.0), 2)}, {}, "not later than"),
        ({"force_sd": np.full(200, 0.5)}, {}, "states an sd of the force"),
        ({}, {"run_labels": ("1", "2")}, "several runs"),
    ],
)
def test_a_record_of_another_kind_is_refused(columns, labels, words):
    case = moving_case(0)
    spoiled = replace(case, records=replace(case.records, **columns), **labels)
    with pytest.raises(InputError, match=words):
        calibrate_dynamic(spoiled)


def test_a_case_that_does_not_suit_the_model_is_refused():
    case = moving_case(0)
    with pytest.raises(InputError) as caught:
        calibrate_dynamic(replace(case, records=make_records(np.linspace(0, 0.1, 8))))
    assert len(caught.value.findings) == 2
    with pytest.raises(InputError, match="no density"):
        calibrate_dynamic(replace(case, gear=replace(case.gear, density=None)))
