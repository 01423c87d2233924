"""A tracked gear: stiffness, predictions and alarms are what they claim to be."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from posteriors import single
from rigs import make_gear
from scipy import stats
from slices import slice_of

from hdcal.data.priors import Prior
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.tracking.stream_prior import prior_from_gear
from hdcal.tracking.tracker import Tracker

# About as well known as after a calibration, so that streams start near the truth.
KNOWN = {
    "K": Prior("lognormal", (2.6, 0.02)),
    "force_offset": Prior("normal", (0.0, 2.0)),
    "sigma": Prior("lognormal", (0.8, 0.15)),
}


@pytest.fixture(scope="module")
def gear():
    return make_gear(**KNOWN)


@pytest.fixture(scope="module")
def start(gear) -> Tracker:
    return Tracker(gear, alarm_rows=100.0)


@pytest.fixture(scope="module")
def truths(gear):
    """Draws of the same beginning: coefficients and noise sd."""
    begin = prior_from_gear(gear, seed=9)
    return begin.coefficients(), np.sqrt(begin.variance)


def readings(truth, sd, count: int, seed: int, *, softer=1.0, at=0, jump=0.0):
    """A stream that loses stiffness or jumps at a row."""
    rng, late = np.random.default_rng(seed), np.arange(count) >= at
    deformation = rng.uniform(0.0, 0.54, count)
    slope = truth[0] * np.where(late, softer, 1.0)
    noise = rng.normal(0.0, sd, count)
    force = slope * deformation + truth[2] + jump * late + noise
    return zip(deformation.tolist(), force.tolist(), strict=True)


def test_another_mounting_moves_a_zero_that_the_gear_file_fixes():
    zero = Prior("fixed", (0.0,))
    fixed = make_gear(**KNOWN | {"force_offset": zero, "deformation_offset": zero})
    tracker, rng = Tracker(fixed), np.random.default_rng(4)
    slope, found = float(np.mean(prior_from_gear(fixed).coefficients()[:, 0])), []
    for run, moved in (("a", 0.0), ("b", 5.0)):
        for deformation in rng.uniform(0.02, 0.54, 60).tolist():
            reading = slope * deformation + moved + float(rng.normal(0.0, 0.8))
            found.append(tracker.update(deformation, reading, run=run))
    # As soon as a few readings have told the zero, nothing is carried from row to row.
    for one in found[70:]:
        assert abs(one["correlation"]) < 0.4
    assert np.std([one["innovation"] for one in found[70:]]) < 1.3


def followed(tracker: Tracker, stream) -> list[dict]:
    mine = copy.deepcopy(tracker)
    return [mine.update(deformation, force) for deformation, force in stream]


@pytest.fixture(scope="module")
def quiet(start, truths) -> list[list[dict]]:
    """Streams without a change, each with a truth of its own from the priors."""
    return [
        followed(start, readings(truths[0][i], truths[1][i], 500, i)) for i in range(40)
    ]


def rate_is(streams, rows: float) -> bool:
    """Whether alarms are as frequent as one in so many rows, to 3 sds of chance."""
    called = sum(one["alarm"] for stream in streams for one in stream)
    expected = sum(map(len, streams)) / rows
    return abs(called - expected) < 3.0 * np.sqrt(expected)


def test_false_alarms_are_as_frequent_as_stated(quiet):
    assert rate_is(quiet, 100.0)
    assert not rate_is(quiet, 200.0)
    assert not rate_is(quiet, 60.0)


def test_scores_are_standard_normal_from_the_first_row_on(quiet):
    first = [one["innovation"] for stream in quiet for one in stream[:20]]
    later = [one["innovation"] for stream in quiet for one in stream[20:]]
    assert stats.kstest(first, "norm").pvalue > 0.01
    assert stats.kstest(later, "norm").pvalue > 0.01


def test_intervals_hold_what_they_promise(quiet, truths):
    for row in (0, 5, 50, 499):
        inside = [
            stream[row]["stiffness_N_per_mm"]["credible_95"][0]
            < truths[0][i][0]
            < stream[row]["stiffness_N_per_mm"]["credible_95"][1]
            for i, stream in enumerate(quiet)
        ]
        # Chance of fewer than 34 of 40 at 95 %: 0.3 %.
        assert sum(inside) >= 34
    inside = []
    for i, answers in enumerate(quiet):
        stream = readings(truths[0][i], truths[1][i], 500, i)
        for one, (_, force) in zip(answers, stream, strict=True):
            low, high = one["force_N"]["predictive_95"]
            inside.append(low < force < high)
    # Four sds of chance in 20 000 rows.
    assert np.mean(inside) == pytest.approx(0.95, abs=0.0062)


@pytest.mark.parametrize(("softer", "most"), [(0.95, 20), (0.98, 80)])
def test_a_softer_gear_is_called_soon(gear, truths, softer, most):
    tracker, delays = Tracker(gear), []
    for seed in range(12):
        stream = readings(truths[0][seed], 0.8, 600, seed, softer=softer, at=300)
        answers = followed(tracker, stream)
        assert not any(one["alarm"] for one in answers[:300])
        called = [one for one in answers[300:] if one["alarm"]]
        assert called and called[0]["alarm_score"] < -1.0
        delays.append(called[0]["row"] - 300)
    assert np.median(delays) <= most


def test_after_an_alarm_the_sums_start_again(gear, truths):
    stream = readings(truths[0][0], 0.8, 400, 3, softer=0.9, at=200)
    answers = followed(Tracker(gear), stream)
    (first, *_) = [one["row"] for one in answers if one["alarm"]]
    assert answers[first - 1]["alarm_since_row"] == 1
    assert answers[first]["alarm_since_row"] == first + 1


SETTINGS = [{"reopen": 0.1}, {"forget": 0.97}]


@pytest.mark.parametrize("settings", slice_of(SETTINGS, SETTINGS[:1]))
def test_a_changed_stiffness_is_learned_anew_if_wanted(gear, truths, settings):
    truth = truths[0][1]

    def last(**how):
        stream = readings(truth, 0.8, 900, 4, softer=0.9, at=600)
        answers = followed(Tracker(gear, **how), stream)
        low, high = answers[-1]["stiffness_N_per_mm"]["credible_95"]
        late = sum(one["alarm"] for one in answers[-100:])
        return low < 0.9 * truth[0] < high, late

    assert last(**settings) == (True, 0)
    knows, alarms = last()
    assert not knows and alarms > 0


def test_another_mounting_may_have_another_zero(gear, truths):
    def alarms(label):
        tracker = Tracker(gear)
        stream = readings(truths[0][2], 0.8, 200, 5, at=100, jump=4.0)
        for row, (deformation, force) in enumerate(stream):
            tracker.update(deformation, force, run=label if row >= 100 else "one")
        return tracker.alarms

    assert alarms("two") == 0
    assert alarms("one") > 0


BAD = [
    ((np.nan, 1.0), {}, "deformation of nan mm does not lie"),
    ((0.1, np.inf), {}, "force of inf N does not lie"),
    ((40.0, 1.0), {}, "a deformation of 40 mm is none of this gear"),
    ((0.1, 45e3), {}, "a force of 45000 N is none of this gear"),
    ((0.1, -45e3), {}, "a force of -45000 N is none of this gear"),
    ((0.1, 1e300), {}, r"force of 1e\+300 N does not lie between -1000000000"),
    ((0.1, 1.0), {"temperature": -300.0}, "absolute zero"),
    ((0.1, 1.0), {"temperature": 2.9e3}, "leaves nothing"),
    ((0.1, 1.0), {"time": np.nan}, "time of nan s does not lie"),
]


@pytest.mark.parametrize(("reading", "more", "words"), BAD)
def test_what_is_no_reading_teaches_nothing(start, reading, more, words):
    tracker = copy.deepcopy(start)
    with pytest.raises(ValueError, match=words):
        tracker.update(*reading, **more)
    assert tracker.rows == 0
    assert tracker.update(0.2, 42.0) == copy.deepcopy(start).update(0.2, 42.0)


def test_settings_out_of_range_are_all_named(gear):
    with pytest.raises(InputError) as caught:
        Tracker(gear, alarm_rows=1.0, forget=1.5, reopen=-1.0)
    assert [f.file for f in caught.value.findings] == [
        "alarm_rows",
        "forget",
        "reopen",
    ]


def test_a_failed_calibration_gives_nothing():
    failed = replace(single(size=40), checks=(Check("mixed", "failed", "by hand"),))
    with pytest.raises(NotUsable):
        Tracker(failed)
