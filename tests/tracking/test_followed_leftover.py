"""A fitted leftover is followed with the stiffness, as the calibration left it."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import beside, plain_draws, ramp_case, written_posterior
from streams import follow

from hdcal.inference.model_average import ModelAverage
from hdcal.prediction.engine.gear_forces import gear_bends, gear_values
from hdcal.prediction.engine.pooled import pool
from hdcal.prediction.engine.untested_reading import UntestedReading
from hdcal.tracking.stream_prior import prior_from_posterior
from hdcal.tracking.tracker import Tracker
from hdcal.tracking.unequal_rows import UnequalRows

# Off the middle of what was tested: there the leftover looks like stiffness.
PLACES = np.linspace(0.25, 0.5, 25)


def with_newtons():
    """Return a posterior whose leftover is of a newton and known to half of that."""
    case, rng = ramp_case(), np.random.default_rng(2)
    size = np.where(np.arange(20) < 8, 1.0, 1e-3) / (1.0 + np.arange(20.0))
    weights = 2.0 * size * (np.array([1.0, -1.0] * 10) + rng.normal(size=(2000, 20)))
    scale = {"gap_sd": np.full(2000, 1.5), "gap_length": np.full(2000, 0.3)}
    draws = plain_draws(case, 2000) | scale | {"gap_weights": weights}
    return written_posterior(case, draws, with_gap=True)


def stream(posterior, draw: int, rows: int, rng):
    """Return readings of a gear that is one draw of the posterior."""
    known = pool(posterior)
    prior = prior_from_posterior(known)
    at = np.resize(PLACES, rows)
    columns = np.column_stack([at, 0.0 * at, 0.0 * at + 1.0, 0.0 * at])
    left = np.asarray(known.problem.discrepancy.columns(at, 0.0 * at))
    coefficients, sd = prior.coefficients()[draw], np.sqrt(prior.variance[draw])
    force = np.hstack([columns, left]) @ coefficients + sd * rng.normal(size=rows)
    return at, force, np.hstack([columns, left]), coefficients


def test_it_is_a_batch_fit_of_stiffness_zero_and_leftover():
    posterior = with_newtons()
    at, force, columns, _ = stream(posterior, 7, 60, np.random.default_rng(0))
    tracker = Tracker(posterior)
    law = tracker._core.prior
    for row in zip(at.tolist(), force.tolist(), strict=True):
        found = tracker.update(*row)
    # Normal equations over σ², with the prior in directions that may vary.
    tall = columns @ law.root
    inner = tall.T @ tall + np.eye(law.root.shape[1])
    along = np.linalg.solve(inner, tall.T @ (force - columns @ law.mean))
    mean = law.mean + law.root @ along
    assert tracker._noise.value == 0.0
    assert found["stiffness_N_per_mm"]["mean"] == pytest.approx(mean[0], rel=1e-9)
    np.testing.assert_allclose(tracker._core.mean, mean, rtol=1e-6, atol=1e-9)


def followed(posterior, streams: int, rows: int = 300) -> tuple[float, float, float]:
    """Return shares of stiffnesses and of readings inside, and alarms over the due."""
    start, inside, read, alarms = Tracker(posterior, alarm_rows=100.0), [], [], 0
    for seed in range(streams):
        rng = np.random.default_rng(400 + seed)
        draw = rng.integers(len(pool(posterior).index))
        at, force, _, truth = stream(posterior, draw, rows, rng)
        held, readings, called = follow(start, at, force, truth[0])
        inside.append(held)
        read += readings
        alarms += called
    return np.mean(inside), np.mean(read), alarms * 100.0 / (streams * rows)


def test_intervals_hold_and_alarms_are_as_many_as_promised():
    inside, read, alarms = followed(with_newtons(), 30)
    # Chance of fewer than 25 of 30 at 95 %: 0.3 %.
    assert inside >= 0.83
    # Four sds of chance in 9000 rows; 90 alarms are due.
    assert read == pytest.approx(0.95, abs=0.01)
    assert 1.0 / 1.5 < alarms < 1.5


def test_a_leftover_that_is_left_out_is_told_by_the_same_count(monkeypatch):
    real = UnequalRows.leftover
    monkeypatch.setattr(UnequalRows, "leftover", lambda self, at: 0.0 * real(self, at))
    inside, _, _ = followed(with_newtons(), 10)
    assert inside < 0.5


def test_what_is_forgotten_of_a_long_wave_fades_to_the_prior_too():
    """Its finest weights are as good as none, and may not grow without end."""
    posterior = with_newtons()
    tree = posterior.tree.copy(deep=True)
    weights = tree["posterior"]["gap_weights"]
    tree["posterior"]["gap_weights"] = weights * 10.0 ** (-4.0 * np.arange(20))
    tracker = Tracker(replace(posterior, tree=tree), forget=0.8)
    rng, found = np.random.default_rng(0), []
    for at in np.resize(PLACES, 2000).tolist():
        answer = tracker.update(at, 205.0 * at + rng.normal(0.0, 0.5))
        found.append(answer["stiffness_N_per_mm"]["sd"])
    assert np.mean(found[-200:]) < 1.5 * np.mean(found[100:300])


def test_the_fit_has_no_part_far_from_what_was_tested():
    posterior = with_newtons()
    reader, values = UntestedReading(pool(posterior)), gear_values(pool(posterior))
    for at in (0.01, 0.3, 0.55, 0.58, 1.5, -0.05, -1.0):
        place = np.array([at])
        own = reader.leftover(place) @ posterior.draws["gap_weights"][5]
        draws, untested = values
        one = {name: column[5] for name, column in draws.items()}
        bends = gear_bends(untested, one)
        _, fitted = bends.leftover(
            posterior.problem, one, place, np.ones(1), np.ones(1)
        )
        np.testing.assert_allclose(own, fitted, rtol=1e-9, atol=1e-12)
    inside, outside = (reader.leftover(np.array([at])) for at in (0.3, 1.5))
    assert np.abs(inside).max() > 0.1 and np.abs(outside).max() < 1e-9


def test_beside_an_effect_it_is_followed_too():
    posterior = with_newtons()
    other = beside(posterior, "contact_onset")
    at, force, _, _ = stream(posterior, 3, 40, np.random.default_rng(1))
    plain, particles = Tracker(posterior), Tracker(other)
    for row in zip(at.tolist(), force.tolist(), strict=True):
        one, two = plain.update(*row), particles.update(*row)
    assert not two["degenerate"]
    one, two = (found["stiffness_N_per_mm"] for found in (one, two))
    assert two["mean"] == pytest.approx(one["mean"], abs=0.3 * one["sd"])
    assert two["sd"] == pytest.approx(one["sd"], rel=0.2)


def halves():
    """Return a calibration that has the leftover or has none, and both alone."""
    case, other = ramp_case(), with_newtons()
    plain = written_posterior(case, plain_draws(case, 2000))
    return ModelAverage({"none": (0.5, plain), "unknown": (0.5, other)}), other


@pytest.mark.thorough
def test_of_several_causes_the_one_that_a_stream_shows_is_followed_as_if_alone():
    mixture, other = halves()
    chances, odds = np.random.default_rng(5), []
    for draw in chances.integers(2000, size=6).tolist():
        at, force, _, _ = stream(other, draw, 200, np.random.default_rng(draw))
        together, alone = Tracker(mixture), Tracker(other)
        for row in zip(at.tolist(), force.tolist(), strict=True):
            one, two = together.update(*row), alone.update(*row)
        odds.append(together._core.weight[1])
        if odds[-1] > 0.99:
            one, two = (found["stiffness_N_per_mm"] for found in (one, two))
            assert one["mean"] == pytest.approx(two["mean"], abs=0.2 * two["sd"])
            assert one["sd"] == pytest.approx(two["sd"], rel=0.1)
    assert sum(share > 0.99 for share in odds) >= 3


@pytest.mark.thorough
def test_the_interval_of_a_mixture_holds_the_stiffness():
    inside, read, alarms = followed(halves()[0], 30)
    assert inside >= 0.83
    assert read == pytest.approx(0.95, abs=0.01)
    assert 1.0 / 1.5 < alarms < 1.5
