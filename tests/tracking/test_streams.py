"""Intervals, scores and alarms of simulated streams are what they claim to be."""

from dataclasses import replace

import numpy as np
import pytest
from mirrored import mirrored
from posteriors import (
    beside,
    plain_draws,
    ramp_case,
    single,
    written_posterior,
)
from rigs import make_gear
from scipy import stats
from slices import slice_of
from streams import Followed, correlated, follow, with_correlation

from hdcal.data.prior import Prior
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.inference.force_model.serial_correlation import CORRELATION
from hdcal.inference.model_average import ModelAverage
from hdcal.tracking.draw_forces import draws_of
from hdcal.tracking.tracker import StreamReading, Tracker

# Ratio of alarms to those that are due. There are fewer in the first hundreds of rows,
# where a correlation may be larger than it seems.
LEAST, MOST = 0.5, 1.5
EVERYWHERE = (0.02, 0.54)


def streams(
    posterior, count, rows, places=EVERYWHERE, *, warm=20.0, rho=0.0, known=None
):
    """Yield streams of gears that are draws of the posterior, with their stiffness.

    Errors at untested conditions and of the discrepancy are from the model itself.
    """
    every, start = draws_of(posterior)[0], Tracker(posterior, alarm_rows=100.0)
    start = start if known is None else with_correlation(start, known)
    for seed in range(count):
        rng = np.random.default_rng(seed)
        one = every.take(rng.integers(every.model.size, size=1))
        at = np.resize(places, rows) if len(places) > 2 else rng.uniform(*places, rows)
        forces = one.at(at, np.full(rows, warm))
        mean, _, excess, error, columns = (np.asarray(part)[:, 0] for part in forces)
        noise = np.sqrt(one.variance[0] + excess)
        force = mean + columns @ one.scores[0] + error * rng.normal()
        force = force + one.values["run_offset_sd"][0] * rng.normal()
        force = force + noise * correlated(rng, rho, rows)
        yield float(one.stiffness[0]), follow(start, at, force, np.full(rows, warm))


def check(found, rows: int) -> None:
    """Check shares of stiffnesses and readings in their intervals, and of alarms."""
    found = list(found)
    held = [low < truth < high for truth, (*_, (low, high)) in found]
    # Chance of as few at 95 %: below 0.3 %.
    assert sum(held) >= stats.binom.ppf(0.003, len(held), 0.95)
    inside = np.mean([np.mean(stream.inside) for _, stream in found])
    # Four sds of chance, twice as many for errors that rows share.
    assert inside == pytest.approx(0.95, abs=8.0 * np.sqrt(0.0475 / rows / len(held)))
    alarms = sum(len(stream.alarms) for _, stream in found)
    assert LEAST < alarms * 100.0 / (rows * len(held)) < MOST


def with_newtons():
    """Return a posterior whose discrepancy is of a newton and known to half of that."""
    case, rng = ramp_case(), np.random.default_rng(2)
    size = np.where(np.arange(20) < 8, 1.0, 1e-3) / (1.0 + np.arange(20.0))
    weights = 2.0 * size * (np.array([1.0, -1.0] * 10) + rng.normal(size=(2000, 20)))
    scale = {"gap_sd": np.full(2000, 1.5), "gap_length": np.full(2000, 0.3)}
    draws = plain_draws(case, 2000) | scale | {"gap_weights": weights}
    return written_posterior(case, draws, with_gap=True)


def with_effect(name: str, **parameters):
    """Return a posterior with an effect; of each parameter middle and sd."""
    case, rng = ramp_case(), np.random.default_rng(3)
    draws = plain_draws(case, 2000)
    for parameter, (middle, sd) in parameters.items():
        draws[f"{name}.{parameter}"] = middle + sd * rng.normal(size=2000)
    return written_posterior(case, draws, effects=[name])


ONSET = {"ratio": (0.3, 0.02), "onset": (0.25, 0.01)}
GROWING = {"share": (0.03, 0.003)}
OFF_THE_MIDDLE = np.linspace(0.25, 0.5, 25)
BEYOND = np.array([0.6, 0.7, 0.8, 0.9, 1.0])
KINDS = {
    "plain": (single, EVERYWHERE),
    "discrepancy": (with_newtons, OFF_THE_MIDDLE),
    "untested deformation": (single, BEYOND),
    "growing noise": (
        lambda: with_effect("heteroscedastic_noise", **GROWING),
        EVERYWHERE,
    ),
    "mixture": (
        lambda: ModelAverage(
            {"none": (0.5, single()), "unknown": (0.5, with_newtons())}
        ),
        EVERYWHERE,
    ),
}


@pytest.mark.parametrize("kind", slice_of(KINDS, ["discrepancy"]))
def test_intervals_and_the_rate_of_alarms_hold(kind):
    make, places = KINDS[kind]
    check(streams(make(), 30, 400, places), 400)


@pytest.mark.thorough
def test_they_hold_at_untested_temperatures_and_in_long_streams():
    check(streams(single(), 30, 400, warm=60.0), 400)
    check(streams(with_newtons(), 16, 2000, OFF_THE_MIDDLE), 2000)


def calibrated_noise(rho: float):
    case = ramp_case()
    found = np.random.default_rng(1).normal(rho, 0.06, 2000)
    return written_posterior(case, plain_draws(case) | {CORRELATION: found})


@pytest.mark.parametrize(
    "noise", slice_of([(0.6, 0.6), (0.6, 0.4), (0.3, 0.0)], [(0.6, 0.4)])
)
def test_the_rate_holds_with_correlated_readings(noise):
    rho, calibrated = noise
    found = list(streams(calibrated_noise(calibrated), 10, 1000, rho=rho))
    check(found, 1000)
    last = [stream.answers[-1]["correlation"] for _, stream in found]
    assert np.mean(last) == pytest.approx(rho, abs=0.08)


def test_a_correlation_that_is_not_taken_out_is_flagged():
    found = list(streams(single(), 4, 1000, rho=0.6, known=0.0))
    assert sum(len(stream.alarms) for _, stream in found) > 2.0 * MOST * 40


def changed(rows: int = 800, *, softer=1.0, jump=0.0, seed=0, label=None, **how):
    """Follow a gear that changes at row 400."""
    rng, late = np.random.default_rng(seed), np.arange(rows) >= 400
    at = rng.uniform(*EVERYWHERE, rows)
    force = 205.0 * np.where(late, softer, 1.0) * at - 1.0 + jump * late
    force += rng.normal(0.0, 0.6, rows)
    tracker, answers = Tracker(single(), **how), []
    for part, run in ((slice(400), "a"), (slice(400, None), label or "a")):
        readings = [
            StreamReading(deformation=x, force=y, run=run)
            for x, y in zip(at[part].tolist(), force[part].tolist(), strict=True)
        ]
        answers += tracker.follow(readings)
    last = answers[-1]["stiffness_N_per_mm"]["credible_95"]
    return Followed(answers, np.ones(rows, bool), last)


@pytest.mark.parametrize(
    ("change", "most"),
    [({"softer": 0.98}, 20), ({"jump": 1.0}, 20), ({"softer": 0.93}, 5)],
)
def test_a_change_raises_the_alarm_soon(change, most):
    delays = []
    for seed in range(4):
        alarms = changed(500, seed=seed, **change).alarms
        assert len(alarms[alarms >= 400])
        delays.append(alarms[alarms >= 400][0] - 399)
    assert np.median(delays) <= most


def test_another_mounting_may_have_another_zero():
    assert not np.any(changed(jump=4.0, label="b").alarms >= 400)
    assert np.any(changed(jump=4.0).alarms >= 400)


def coarse(noise: float, count: int, rows: int):
    """Return shares of readings and stiffnesses inside, five deformations in turn."""
    case = ramp_case(make_gear(resolution=0.98))
    sigma = noise * np.exp(np.random.default_rng(1).normal(0.0, 0.15, 2000))
    draws = plain_draws(case) | {"sigma": sigma}
    posterior = written_posterior(case, draws)
    at, start = np.resize(np.linspace(0.05, 0.5, 5), rows), Tracker(posterior)
    every, found = draws_of(posterior)[0], []
    for seed in range(count):
        rng = np.random.default_rng(500 + seed)
        one = every.take(rng.integers(2000, size=1))
        force = np.asarray(one.at(at, np.full(rows, 20.0)).mean)[:, 0]
        force = force + rng.normal(0.0, one.values["sigma"][0], rows) + rng.normal()
        stream = follow(start, at, 0.98 * np.round(force / 0.98))
        low, high = stream.stiffness
        found.append((stream.inside.mean(), low < one.stiffness[0] < high))
    return np.mean(found, axis=0)


@pytest.mark.thorough
def test_intervals_hold_where_every_force_is_read_many_times(monkeypatch):
    reading, stiffness = coarse(0.05, 25, 300)
    assert reading > 0.93
    # Chance of fewer than 20 of 25 at 95 %: 0.1 %.
    assert stiffness >= 0.8
    # Readings that count as new each time are flagged.
    monkeypatch.setattr("hdcal.tracking.draw_forces.CELLS", 0)
    assert coarse(0.05, 12, 300)[1] < 0.7


def test_an_effect_is_followed_and_few_draws_get_no_interval():
    onset = with_effect("contact_onset", **ONSET)
    rng, found = np.random.default_rng(1), None
    at = rng.uniform(*EVERYWHERE, 2000)
    force = 205.0 * (at + 0.3 * np.maximum(0.0, at - 0.25)) - 1.0
    found = follow(Tracker(onset), at, force + rng.normal(0.0, 0.6, 2000))
    assert found.inside.mean() == pytest.approx(0.95, abs=0.02)
    first, last = found.answers[0], found.answers[-1]
    assert not first["degenerate"] and first["stiffness_N_per_mm"]["credible_95"]
    assert last["degenerate"] and last["effective_particles"] < 5.0
    assert last["stiffness_N_per_mm"]["credible_95"] is None


@pytest.mark.parametrize(
    ("name", "known"),
    [
        ("coulomb_friction", {"unloading"}),
        ("outliers", set()),
        ("charge_leakage", {"time"}),
    ],
)
def test_what_cannot_be_followed_is_refused_or_left_out(name, known):
    case = ramp_case(known=known)
    plain = written_posterior(case, plain_draws(case))
    other = beside(plain, name)
    with pytest.raises(InputError, match=name):
        Tracker(other)
    pair = ModelAverage({"none": (0.8, plain), name: (0.2, other)})
    assert any(name in note for note in Tracker(pair).notes)


@pytest.mark.parametrize("effect", [None, "progressive_stiffening"])
def test_a_mirrored_stream_has_the_mirrored_answers(effect):
    # A zero of the mounting that is drawn at random would not be mirrored.
    case = ramp_case(make_gear(run_offset_sd=Prior("fixed", (0.0,))))
    draws, names = plain_draws(case, 512), [effect] if effect else []
    if effect:
        draws["progressive_stiffening.slope"] = np.linspace(0.2, 0.4, 512)
    known = written_posterior(case, draws, effects=names)
    trackers = [Tracker(each, alarm_rows=100.0) for each in (known, mirrored(known))]
    rng = np.random.default_rng(4)
    at, warm = rng.uniform(0.05, 0.6, 120), rng.uniform(15.0, 25.0, 120)
    force = np.where(np.arange(120) < 60, 205.0, 180.0) * at - 1.0
    force += rng.normal(0.0, 0.6, 120)
    one, two = (
        follow(tracker, sign * at, sign * force, warm)
        for tracker, sign in zip(trackers, (1.0, -1.0), strict=True)
    )
    assert len(one.alarms) and one.alarms.tolist() == two.alarms.tolist()
    for found, other in zip(one.answers, two.answers, strict=True):
        for name in ("innovation", "alarm_score"):
            assert other[name] == pytest.approx(-found[name], rel=1e-6, abs=1e-8)
        low, high = found["force_N"]["predictive_95"]
        assert other["force_N"]["predictive_95"] == pytest.approx([-high, -low])
        mean = found["stiffness_N_per_mm"]["mean"]
        assert other["stiffness_N_per_mm"]["mean"] == pytest.approx(mean, rel=1e-9)


def test_a_failed_calibration_gives_nothing():
    failed = replace(single(size=40), checks=(Check("mixed", "failed", "by hand"),))
    with pytest.raises(NotUsable):
        Tracker(failed)


@pytest.mark.parametrize("bad", [(np.nan, 1.0), (0.1, 1e300), (0.1, "2")])
def test_an_impossible_reading_teaches_nothing(bad):
    tracker = Tracker(single())
    with pytest.raises(ValueError):
        tracker.update(*bad)
    with pytest.raises(ValueError):
        tracker.update(0.1, 1.0, temperature=-300.0)
    assert tracker.rows == 0
    assert tracker.update(0.2, 42.0) == Tracker(single()).update(0.2, 42.0)
