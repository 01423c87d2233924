"""Readings at untested conditions: their bands are wide, and they teach little."""

from dataclasses import replace

import numpy as np
import pytest
from posteriors import beside, regressed, single, with_leftover

import hdcal
from hdcal.errors import InputError
from hdcal.inference.hypotheses import LEFT_OUT
from hdcal.inference.mixed_posterior import mixed_posterior
from hdcal.prediction.engine.untested_reading import UntestedReading
from hdcal.tracking.tracker import Tracker


def width(found: dict) -> float:
    low, high = found["force_N"]["predictive_95"]
    return high - low


def test_the_band_widens_as_that_of_predict():
    posterior = single()
    added = UntestedReading(posterior)
    for at, warm in ((0.9, 20.0), (0.4, 80.0), (-0.3, 20.0)):
        tested = Tracker(posterior)
        tested._untested = None
        narrow = width(tested.update(at, 205.0 * at - 1.0, temperature=warm))
        found = Tracker(posterior).update(at, 205.0 * at - 1.0, temperature=warm)
        _, sd = added.at(at, warm)
        expected = np.hypot(narrow, 2 * 1.96 * sd)
        assert not found["tested"]
        assert width(found) == pytest.approx(expected, rel=0.1)
        assert width(found) > 1.05 * narrow
    inside = added.at(0.4, 20.0)
    assert inside == pytest.approx((0.0, 0.0), abs=1e-9)


def test_what_is_added_is_what_predict_adds():
    posterior = single()
    shift, sd = UntestedReading(posterior).at(0.4, 80.0)
    far, near = (
        hdcal.predict(posterior, [0.4], [warm]).columns() for warm in (80.0, 20.0)
    )
    spread = [
        np.ptp([found[f"physics_{end}_N"][0] for end in ("lo", "hi")]) / 3.92
        for found in (far, near)
    ]
    # Young's modulus has its own, smaller part in it.
    assert spread[0] == pytest.approx(np.hypot(sd, spread[1]), rel=0.1)
    assert abs(shift) < 0.2 * sd


def test_a_bend_beyond_what_was_tested_is_not_learned_as_stiffness():
    rng = np.random.default_rng(2)
    x = np.linspace(0.02, 0.54, 30)
    posterior = regressed(x, 200.0 * x + rng.normal(0.0, 0.5, 30), rng)
    known, naive = Tracker(posterior), Tracker(posterior)
    naive._untested = None
    for at in np.linspace(0.6, 1.0, 40):
        # Stiffer beyond the tested range, as no row could show.
        force = 200.0 * at * (1.0 + 0.3 * (at - 0.54)) + rng.normal(0.0, 0.5)
        found, other = known.update(at, force), naive.update(at, force)
    assert found["stiffness_N_per_mm"]["mean"] == pytest.approx(200.0, abs=10.0)
    assert other["stiffness_N_per_mm"]["mean"] > 215.0


def mixture(**shares: float):
    made = {"none": single(), "contact_onset": beside(single(), "contact_onset")}
    made["unknown"] = with_leftover()
    return mixed_posterior({n: (share, made[n]) for n, share in shares.items()})


def test_causes_that_can_be_followed_are_and_the_rest_is_said():
    words = Tracker(mixture(none=0.5, contact_onset=0.3, unknown=0.2)).describe()
    assert "averages over no gap (50 %), contact onset (30 %)" in words
    assert "something outside the library cannot be followed" in words
    assert "20 % of the probability has no part" in words
    # Forgetting goes with a line only.
    words = Tracker(mixture(none=0.7, contact_onset=0.3), forget=0.99).describe()
    assert "contact onset cannot be followed row by row: 30 %" in words
    assert "averages" not in Tracker(single()).describe()


def test_where_most_cannot_be_followed_nothing_is():
    with pytest.raises(InputError, match="holds a leftover discrepancy"):
        Tracker(mixture(none=0.4, unknown=0.6))


def test_what_was_left_out_is_said():
    posterior = mixture(none=0.6, contact_onset=0.4)
    told = {"probability": 0.02, "counted_as": "none"}
    settings = {**posterior.settings, LEFT_OUT: told}
    words = Tracker(replace(posterior, settings=settings)).describe()
    assert "2 % of the probability lies on hypotheses" in words
