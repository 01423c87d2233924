"""A gear that warms while it moves: its stiffness follows the temperature."""

import numpy as np
import pytest
from moving import TRUTH, motion, moving_gear
from rigs import make_case, make_records
from short import SHORT

from hdcal import calibrate_dynamic
from hdcal.motion import bands
from hdcal.motion.bands import motion_bands
from hdcal.motion.dynamic_priors import dynamic_site_priors
from hdcal.motion.dynamic_problem import build_dynamic, predict_states
from hdcal.physics import linear_response as response
from hdcal.physics.linear_response import linear_response

ROWS, ALPHA = 380, 5e-4


def warming_case(seed: int, span: float = 20.0, known=("time", "temperature")):
    """Return a gear shaken by a random force while it warms by some kelvins."""
    rng = np.random.default_rng(seed)
    time = np.arange(ROWS) / 3000.0
    force = 60.0 + 25.0 * rng.normal(size=ROWS)
    warm = 20.0 + span * time / time[-1]
    columns = {"known": set(known), "time": time, "temperature": warm}
    blank = make_case(make_records(np.zeros(ROWS), force, **columns), moving_gear())
    mean = motion(TRUTH, blank)
    rise = 0.5 * (warm[1:] + warm[:-1]) - blank.gear.reference_temperature
    start = np.array([force[0] / mean.stiffness, 0.0])
    softer = mean._replace(stiffness=mean.stiffness * (1.0 - ALPHA * rise))
    clean = linear_response(softer, time, force, start)
    read = np.asarray(clean)[:, 0] + TRUTH["deformation_offset"]
    read = read + rng.normal(0.0, TRUTH["deformation_sigma"], ROWS)
    return make_case(make_records(read, force, **columns), blank.gear)


@pytest.fixture(scope="module")
def posterior():
    return calibrate_dynamic(warming_case(0), effects=(), **SHORT)


@pytest.mark.thorough
def test_alpha_is_found_in_a_record_that_warms(posterior):
    assert posterior.usable, posterior.reasons
    alpha = posterior.draws["alpha"]
    assert posterior.diagnoses["alpha"].driven_by == "data"
    # 99.9 % of a normal posterior; its quantiles would rest on one draw in a thousand.
    low, high = alpha.mean() + 3.3 * alpha.std() * np.array([-1.0, 1.0])
    assert low <= ALPHA <= high and high < 2.0 * ALPHA
    inside = motion_bands(posterior)
    read = posterior.case.records.deformation
    held = (inside.new_measurement_lo_mm <= read) & (
        read <= inside.new_measurement_hi_mm
    )
    assert held.mean() >= 0.9


@pytest.mark.thorough
def test_at_one_temperature_alpha_is_left_to_its_prior():
    case = warming_case(1, 0.0)
    problem = build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")
    assert problem.change is None


def values():
    return TRUTH | {
        "alpha": ALPHA,
        "initial_deformation": 0.2,
        "initial_velocity": 3.0,
    }


def problem_of(span: float):
    case = warming_case(0, span)
    return build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")


def test_a_temperature_that_hardly_changes_gives_what_one_temperature_does():
    one = predict_states(problem_of(0.0), values())
    near = predict_states(problem_of(1e-9), values())
    np.testing.assert_allclose(near, one, rtol=1e-9, atol=1e-8)
    warmer = predict_states(problem_of(20.0), values())
    assert np.abs(np.asarray(warmer - one))[:, 0].max() > 1e-3


@pytest.mark.thorough
def test_stretches_of_a_warming_record_give_those_of_the_whole(monkeypatch):
    problem = problem_of(20.0)
    whole = predict_states(problem, values())
    many = {name: np.full(3, value) for name, value in values().items()}
    spans = list(bands._stretches(problem, many, 0))
    with monkeypatch.context() as short:
        short.setattr(response, "_STRETCH", 50)
        in_parts = predict_states(problem, values())
        short.setattr(bands, "_STRETCH", 70)
        parts = list(bands._stretches(problem, many, 0))
    np.testing.assert_allclose(in_parts, whole, rtol=1e-9, atol=1e-9)
    joined, of_whole = np.concatenate(parts, axis=1), np.concatenate(spans, axis=1)
    np.testing.assert_allclose(joined, of_whole, atol=1e-10)
