"""Readings at untested conditions: their bands are wide, and they teach little."""

import numpy as np
import pytest
from posteriors import beside, regressed, single, with_leftover
from scipy import stats
from streams import follow

import hdcal
from hdcal.errors import InputError
from hdcal.inference.model_average import ModelAverage
from hdcal.prediction.engine.pooled import pool
from hdcal.prediction.engine.untested_reading import Addition, UntestedReading
from hdcal.tracking.stream_prior import prior_from_posterior
from hdcal.tracking.tracker import Tracker

NOISE = "outliers"
PLACES = [0.6, 0.7, 0.8, 0.9, 1.0]


def width(found: dict) -> float:
    low, high = found["force_N"]["predictive_95"]
    return high - low


def spread(added: Addition) -> float:
    return float(np.hypot(np.linalg.norm(added.columns), added.rest))


def test_the_band_widens_as_that_of_predict():
    posterior = single()
    added = UntestedReading(pool(posterior))
    for at, warm in ((0.9, 20.0), (0.4, 80.0), (-0.3, 20.0)):
        tested = Tracker(posterior)
        tested._unequal = None
        narrow = width(tested.update(at, 205.0 * at - 1.0, temperature=warm))
        found = Tracker(posterior).update(at, 205.0 * at - 1.0, temperature=warm)
        sd = spread(added.at(at, warm))
        expected = np.hypot(narrow, 2 * 1.96 * sd)
        assert not found["tested"]
        assert width(found) == pytest.approx(expected, rel=0.1)
        assert width(found) > 1.05 * narrow
    inside = added.at(0.4, 20.0)
    assert (inside.shift, spread(inside)) == (0.0, 0.0)


@pytest.mark.parametrize(("at", "warm"), [(0.4, 80.0), (0.9, 20.0), (-0.3, 20.0)])
def test_what_is_added_is_what_predict_adds(at, warm):
    posterior = single()
    added = UntestedReading(pool(posterior)).at(at, warm)
    # Few draws have large bends: an end is known by the mean of some seeds.
    far, near = (
        [hdcal.predict(posterior, [where], [heat], seed=seed) for seed in range(6)]
        for where, heat in ((at, warm), (0.4, 20.0))
    )
    ends = [
        np.mean([one.physics_hi_N[0] - one.physics_lo_N[0] for one in found]) / 3.92
        for found in (far, near)
    ]
    # A stream takes the variance of 256 draws, which is known to 9 %, for that of a
    # normal law: where bends are of many sizes ends lie a tenth farther out.
    assert ends[0] == pytest.approx(np.hypot(spread(added), ends[1]), rel=0.15)


def test_the_drift_has_no_preferred_sense():
    added = UntestedReading(pool(single())).at(0.4, 80.0)
    shift, sd = added.shift, spread(added)
    assert abs(shift) < 0.2 * sd


def test_a_bend_beyond_what_was_tested_is_not_learned_as_stiffness():
    rng = np.random.default_rng(2)
    x = np.linspace(0.02, 0.54, 30)
    posterior = regressed(x, 200.0 * x + rng.normal(0.0, 0.5, 30), rng)
    known, naive = Tracker(posterior), Tracker(posterior)
    naive._unequal = None
    for at in np.linspace(0.6, 1.0, 40):
        # Stiffer beyond the tested range, as no row could show.
        force = 200.0 * at * (1.0 + 0.3 * (at - 0.54)) + rng.normal(0.0, 0.5)
        found, other = known.update(at, force), naive.update(at, force)
    assert found["stiffness_N_per_mm"]["mean"] == pytest.approx(200.0, abs=10.0)
    assert other["stiffness_N_per_mm"]["mean"] > 215.0


def followed(posterior, places, streams: int, rows: int, alarm_rows: float = 100.0):
    """Follow readings at places beyond the tested range, whose bend is from its law.

    Returns:
        Share of streams whose stiffness lies in its interval at the end, share of
        readings in theirs, and alarms over those due.
    """
    added, prior = (
        UntestedReading(pool(posterior)),
        prior_from_posterior(pool(posterior)),
    )
    start = Tracker(posterior, alarm_rows=alarm_rows)
    stiffness, reading, alarms = [], [], 0
    terms = [added.at(place, 20.0) for place in places]
    for seed in range(streams):
        rng = np.random.default_rng(800 + seed)
        draw = rng.integers(len(prior.variance))
        truth, sd = prior.coefficients()[draw], np.sqrt(prior.variance[draw])
        common = rng.normal(size=len(terms[0].columns))
        at = np.resize(places, rows)
        bend = [t.shift + t.columns @ common + t.rest * rng.normal() for t in terms]
        force = truth[0] * at + truth[2] + np.resize(bend, rows)
        force = force + rng.normal(0.0, sd, rows)
        held, readings, called = follow(start, at, force, truth[0])
        stiffness.append(held)
        reading += readings
        alarms += called
    due = streams * rows / alarm_rows
    return np.mean(stiffness), np.mean(reading), alarms / due


def test_a_common_error_is_never_averaged_away():
    stiffness, reading, alarms = followed(single(), PLACES, 30, 150)
    # Chance of fewer than 25 of 30 at 95 %: 0.3 %.
    assert stiffness >= 0.83
    # Four sds of chance in 4500 rows; 45 alarms are due.
    assert reading == pytest.approx(0.95, abs=0.013)
    assert 1.0 / 1.5 < alarms < 1.5


def test_errors_that_are_taken_as_independent_are_flagged(monkeypatch):
    real = UntestedReading.at

    def independent(self, *at):
        found = real(self, *at)
        return Addition(found.shift, 0.0 * found.columns, spread(found))

    posterior = single()
    reader, places = UntestedReading(pool(posterior)), np.resize(PLACES, 600).tolist()
    # A bend that is one sd below its mean.
    bend = {at: a.shift - spread(a) for at in PLACES for a in [reader.at(at, 20.0)]}

    def last() -> list[float]:
        tracker, rng, found = Tracker(posterior), np.random.default_rng(0), {}
        for at in places:
            force = 205.0 * at - 1.0 + bend[at] + rng.normal(0.0, 0.6)
            found = tracker.update(at, force)
        return found["stiffness_N_per_mm"]["credible_95"]

    low, high = last()
    assert low < 205.0 < high
    monkeypatch.setattr(UntestedReading, "at", independent)
    low, high = last()
    assert not low < 205.0 < high


@pytest.mark.slow
@pytest.mark.parametrize("places", [[0.81], PLACES])
def test_a_common_error_is_never_averaged_away_in_long_streams(places):
    stiffness, reading, alarms = followed(single(), places, 500, 2000)
    # Chance of as few at 95 %.
    assert stats.binom.cdf(round(500 * stiffness), 500, 0.95) > 1e-3
    assert reading == pytest.approx(0.95, abs=0.003)
    assert 1.0 / 1.5 < alarms < 1.5


def mixture(**shares: float):
    made = {n: beside(single(), n) for n in shares.keys() & {"contact_onset", NOISE}}
    made |= {"none": single(), "unknown": with_leftover()}
    return ModelAverage({n: (share, made[n]) for n, share in shares.items()})


def test_where_most_cannot_be_followed_nothing_is():
    with pytest.raises(InputError, match="'outliers' shapes the noise"):
        Tracker(mixture(none=0.4, **{NOISE: 0.6}))
