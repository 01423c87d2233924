"""False alarms are as frequent as stated: correlated readings, forgetting."""

import copy

import numpy as np
import pytest
from moving import still_posterior

from hdcal.tracking import tracker as tracking
from hdcal.tracking.change_alarm import threshold_for
from hdcal.tracking.linear_core import LinearCore
from hdcal.tracking.normal_inverse_gamma import NormalInverseGamma
from hdcal.tracking.serial_correlation import SerialCorrelation, WhiteRow
from hdcal.tracking.tracker import Tracker

ALARM_ROWS = 100.0
# Largest ratio of the rates seen and stated, either way.
MOST = 1.5


@pytest.fixture(autouse=True)
def simulated_once(monkeypatch):
    """All streams begin alike: the threshold of one is that of all."""
    real, known = tracking.forgetting_threshold, {}

    def remembered(law, forget, design, rows, rho):
        key = forget, rows, round(rho, 1)
        if key not in known:
            known[key] = real(law, forget, design, rows, rho)
        return known[key]

    monkeypatch.setattr(tracking, "forgetting_threshold", remembered)


def correlated(rng, rho: float, count: int) -> np.ndarray:
    noise = rng.normal(size=count)
    for row in range(1, count):
        noise[row] = rho * noise[row - 1] + np.sqrt(1.0 - rho**2) * noise[row]
    return noise


def stream(seed: int, rho: float, count: int, softer: float = 1.0, at: int = 0):
    """Readings of the calibrated gear, which may lose stiffness at a row."""
    rng, posterior = np.random.default_rng(seed), still_posterior()
    stiffness = float(np.median(posterior.draws["stiffness"]))
    deformation = rng.uniform(0.0, 0.54, count)
    slope = stiffness * np.where(np.arange(count) >= at, softer, 1.0)
    force = slope * deformation + rng.normal() + correlated(rng, rho, count)
    return zip(deformation.tolist(), force.tolist(), strict=True)


def start(forget: float = 1.0, alarm_rows: float = ALARM_ROWS) -> Tracker:
    return Tracker(still_posterior(K=0.02), alarm_rows=alarm_rows, forget=forget)


def ratio(tracker: Tracker, rho: float, streams: int, count: int = 600) -> float:
    """Return false alarms over those due."""
    alarms = 0
    for seed in range(streams):
        mine = copy.deepcopy(tracker)
        for deformation, force in stream(seed, rho, count):
            mine.update(deformation, force)
        alarms += mine.alarms
    return alarms * ALARM_ROWS / (streams * count)


def holds(found: float) -> bool:
    return 1.0 / MOST < found < MOST


QUICK = (0.6, 1.0)
LONGER = pytest.param(0.0, 0.9, marks=pytest.mark.thorough)


@pytest.mark.parametrize(("rho", "forget"), [QUICK, LONGER])
def test_the_stated_rate_holds(rho, forget):
    # 90 alarms are due. Until a correlation is noticed there are more: long streams.
    assert holds(ratio(start(forget), rho, 6, 1500))


@pytest.mark.slow
@pytest.mark.parametrize("rho", [0.0, 0.3, 0.6])
@pytest.mark.parametrize("forget", [1.0, 0.99, 0.9])
def test_the_stated_rate_holds_everywhere(rho, forget):
    assert holds(ratio(start(forget), rho, 40, 1500))


def test_a_correlation_that_is_not_taken_out_is_flagged(monkeypatch):
    def same(_, columns, force: float) -> WhiteRow:
        return WhiteRow(columns, force, 0.0, 1.0)

    monkeypatch.setattr(SerialCorrelation, "whiten", same)
    assert ratio(start(), 0.6, 6) > MOST


def test_the_threshold_of_independent_scores_is_flagged_when_forgetting(monkeypatch):
    usual = threshold_for(ALARM_ROWS)
    monkeypatch.setattr(tracking, "forgetting_threshold", lambda *_: usual)
    assert ratio(start(0.9), 0.0, 12) < 1.0 / MOST


@pytest.mark.parametrize(
    ("rho", "forget", "most"), [(0.0, 1.0, 15), (0.6, 1.0, 40), (0.0, 0.9, 20)]
)
def test_a_softer_gear_is_still_called(rho, forget, most):
    tracker, delays = start(forget, 10_000.0), []
    for seed in range(8):
        mine, delay = copy.deepcopy(tracker), 201
        rows = stream(seed, rho, 500, softer=0.93, at=300)
        for row, (deformation, force) in enumerate(rows):
            if mine.update(deformation, force)["alarm"] and row >= 300:
                delay = row - 299
                break
        delays.append(delay)
    assert np.median(delays) <= most


def scores_after_pauses(rho: float, told: bool) -> float:
    """Return the root mean square of the scores of first readings after a pause.

    Noise forgets over it. A pause is a long step of time, or a bad line; or, where
    nobody told, neither.
    """
    tracker, rng, found, time = start(), np.random.default_rng(2), [], 0.0
    stiffness = float(np.median(still_posterior().draws["stiffness"]))
    for group in range(1000):
        time += 100.0 if group % 2 else 1.0
        if told and not group % 2:
            tracker.skip()
        for row, noise in enumerate(correlated(rng, rho, 6).tolist()):
            at, time = float(rng.uniform(0.0, 0.54)), time + 1.0
            clock = {"time": time} if told else {}
            answer = tracker.update(at, stiffness * at + noise, **clock)
            if row == 0 and group > 200:
                found.append(answer["innovation"])
    return float(np.sqrt(np.mean(np.square(found))))


def test_noise_that_a_pause_interrupts_is_not_carried_over_it():
    assert scores_after_pauses(0.6, told=True) == pytest.approx(1.0, abs=0.1)
    assert scores_after_pauses(0.6, told=False) > 1.2


def test_what_is_a_pause_goes_by_the_usual_step():
    def carries(times) -> list[bool]:
        noise, found = SerialCorrelation(), []
        noise.value = 0.5
        for time in times:
            noise.follow(time)
            found.append(noise.whiten(np.ones(2), 1.0).carried != 0.0)
        return found

    assert carries([1, 2, 3, 40, 41]) == [False, True, True, False, True]
    assert carries([1, 2, 3, 0, 1]) == [False, True, True, False, True]
    # A row without a time hides no pause, and a first pause is not the usual step.
    assert carries([1, 2, None, 90]) == [False, True, True, False]
    assert carries([0, 3600, 3601, 3602, 3700]) == [False, True, True, True, False]


def test_the_answer_and_the_words_state_the_rate():
    tracker = start(alarm_rows=500.0)
    assert "one false alarm in 500 readings" in tracker.describe()
    found = tracker.update(0.2, 38.0)
    assert found["false_alarm_rows"] == 500.0
    assert found["correlation"] == 0.0
    tracker.skip()
    assert tracker.summary() == (
        "2 rows, 0 alarms; without a change 0.002 false ones are due in 1 readings"
    )


def test_more_alarms_than_chance_gives_are_followed_by_advice():
    tracker = start(alarm_rows=500.0)
    tracker.rows = tracker._readings = 600
    for alarms, said in ((1, False), (4, False), (5, True)):
        tracker.alarms = alarms
        assert ("learned anew" in tracker.summary()) is said


def test_whitened_rows_give_the_least_squares_answer_of_correlated_ones():
    """Against one problem of all rows and their covariance, the slow twin."""
    rng, rho, count = np.random.default_rng(3), 0.6, 80
    prior = NormalInverseGamma(np.array([200.0, 0.0]), np.diag([50.0, 9.0]), 5.0, 4.0)
    design = np.stack([rng.uniform(0.0, 0.5, count), np.ones(count)], axis=1)
    force = design @ [205.0, 1.0] + correlated(rng, rho, count)
    core, noise = LinearCore(prior), SerialCorrelation()
    noise.value = rho
    for columns, reading in zip(design, force.tolist(), strict=True):
        row = noise.whiten(columns, reading)
        assert row.carried + row.scale * row.force == pytest.approx(reading)
        core.step(row.columns, row.force)
    rows = np.arange(count)
    covariance = rho ** np.abs(rows[:, None] - rows)
    before = np.linalg.inv(prior.root @ prior.root.T)
    precision = before + design.T @ np.linalg.solve(covariance, design)
    target = before @ prior.mean + design.T @ np.linalg.solve(covariance, force)
    np.testing.assert_allclose(core.mean, np.linalg.solve(precision, target), rtol=1e-9)
    spread = core.root @ core.root.T
    np.testing.assert_allclose(spread, np.linalg.inv(precision), rtol=1e-9)


def test_another_mounting_begins_a_new_row():
    noise = SerialCorrelation()
    noise.value = 0.5
    noise.whiten(np.ones(2), 1.0)
    assert noise.whiten(np.ones(2), 1.0).scale < 1.0
    noise.restart()
    assert noise.whiten(np.ones(2), 1.0).scale == 1.0
