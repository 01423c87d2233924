"""A long record of a moving gear gives what a short one does, in bounded memory."""

import jax
import numpy as np
import pytest
from moving import TRUTH, motion, moving_case

from hdcal.inference.likelihood import densities
from hdcal.motion import bands, dynamic_calibration, frequency_scan
from hdcal.motion.dynamic_priors import dynamic_site_priors
from hdcal.motion.dynamic_problem import build_dynamic
from hdcal.physics import linear_response as response


def problem_of(rows: int):
    case = moving_case(0, rows=rows)
    return build_dynamic(case, dynamic_site_priors(case, "ring"), "ring")


def answers(gear, time, force, start):
    """Return states and the gradient of their size."""

    def size(gear, start):
        states = response.linear_response(gear, time, force, start)
        return (states[:, 0] ** 2).sum(), states

    return jax.jacrev(size, argnums=(0, 1), has_aux=True)(gear, start)


@pytest.mark.thorough
def test_stretches_give_the_response_of_the_whole(monkeypatch):
    case = moving_case(0, rows=333)
    time, force = np.asarray(case.records.time), np.asarray(case.records.force)
    start = np.array([0.2, -3.0])
    gear = motion(TRUTH, case)
    whole = answers(gear, time, force, start)
    monkeypatch.setattr(response, "_STRETCH", 50)
    stretched = answers(gear, time, force, start)
    for one, other in zip(jax.tree.leaves(whole), jax.tree.leaves(stretched), strict=1):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9)


def test_bands_in_stretches_are_those_of_the_whole(monkeypatch):
    problem, rng = problem_of(300), np.random.default_rng(0)
    values = {
        name: value * np.exp(0.01 * rng.standard_normal(40))
        for name, value in TRUTH.items()
    }
    values |= {"alpha": np.full(40, 3e-4), "initial_velocity": rng.normal(size=40)}
    values |= {"initial_deformation": np.full(40, 0.2)}
    seed = 0
    whole = np.concatenate(list(bands._stretches(problem, values, seed)), axis=1)
    assert whole.shape == (6, 300)
    monkeypatch.setattr(bands, "_STRETCH", 70)
    parts = list(bands._stretches(problem, values, seed))
    assert [part.shape[1] for part in parts] == [70, 70, 70, 70, 20]
    np.testing.assert_allclose(np.concatenate(parts, axis=1), whole, atol=1e-10)


@pytest.mark.thorough
def test_a_window_finds_the_peak_of_the_whole(monkeypatch):
    problem = problem_of(600)

    def frequency(values) -> float:
        stiffness = values["K"] * values["E0"] if "K" in values else values["_KE0"]
        return np.sqrt(stiffness * problem.unit_stiffness / values["mass"]) / 2 / np.pi

    whole = frequency_scan.scan(problem, 1)[0]
    monkeypatch.setattr(frequency_scan, "_WINDOW", 150)
    found = frequency_scan.scan(problem, 1)[0]
    assert frequency(found) == pytest.approx(frequency(whole), rel=5e-3)
    # The start is that of the record, not of the window.
    for name in ("initial_deformation", "deformation_offset"):
        assert found[name] == pytest.approx(whole[name], abs=5e-3)


def test_of_many_rows_and_draws_only_totals_are_kept(monkeypatch):
    problem = problem_of(200)
    shape = (2, 5)
    values = {name: np.full(shape, value) for name, value in TRUTH.items()}
    values |= {"alpha": np.full(shape, 3e-4), "initial_velocity": np.zeros(shape)}
    values |= {"initial_deformation": np.full(shape, 0.2)}
    nothing = np.zeros(shape)
    draws = dynamic_calibration.Draws(values, *[nothing] * 5, np.zeros(2), 0.8)
    each = dynamic_calibration._log_likelihood(problem, draws)["deformation"]
    assert each.shape == (2, 5, 200)
    monkeypatch.setattr(dynamic_calibration, "MOST_LOG_LIKELIHOODS", 1999)
    assert dynamic_calibration._log_likelihood(problem, draws) == {}
    total = densities(problem, draws.values)[1]
    np.testing.assert_allclose(total, each.sum(axis=-1), rtol=1e-10)
