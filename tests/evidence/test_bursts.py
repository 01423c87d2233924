"""What outliers take of a structure is structure; outliers that are none stay noise."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import judged, rich, simulated
from slices import slice_of

from hdcal.evidence import bursts
from hdcal.evidence.bursts import log_sign_odds

NOISE = 0.4


def with_errors(case, error: np.ndarray):
    records = case.records
    return replace(case, records=replace(records, force=records.force + error))


def stuck(rows: int, seed: int) -> np.ndarray:
    """Return a chip that lies under the punch at times: stretches of seven rows."""
    rng, place = np.random.default_rng(seed), np.arange(rows)
    starts = rng.choice(np.arange(10, rows - 10, 20), 4, replace=False)
    return sum(8.0 * NOISE * ((place >= s) & (place < s + 7)) for s in starts)


def wild(rows: int, seed: int) -> np.ndarray:
    """Return a few readings that are far off, either way and anywhere."""
    rng = np.random.default_rng(seed)
    error = np.zeros(rows)
    error[rng.choice(rows, 9, replace=False)] = 12.0 * NOISE * rng.choice([-1, 1], 9)
    return error


@pytest.mark.parametrize("seed", slice_of([1, 2, 3], [1]))
def test_stretches_of_one_sign_are_no_outliers(seed: int):
    case = simulated(rich(), seed=seed)
    found = judged(with_errors(case, stuck(len(case.records.force), seed)))
    assert found.which.verdict == "unknown"
    assert found.which.inclusion["outliers"] < 0.5


def test_friction_with_stretches_beside_it_is_friction_and_something_else():
    """The effect stays the cause, and the stretches are what lies beside it."""
    case = simulated(rich(), {"coulomb_friction": {"force": 4.0}}, seed=5)
    found = judged(with_errors(case, stuck(len(case.records.force), 5))).which
    assert found.effect == "coulomb_friction"
    assert found.inclusion["coulomb_friction"] > 0.9
    assert found.remainder is not None
    assert found.remainder.probability > 0.9
    assert found.remainder.share.median < 0.4


@pytest.mark.parametrize("seed", slice_of([1, 2, 3], [1]))
def test_readings_that_are_far_off_stay_outliers(seed: int):
    case = simulated(rich(), seed=seed)
    found = judged(with_errors(case, wild(len(case.records.force), seed)))
    assert found.which.inclusion["outliers"] > 0.9


def test_signs_by_chance_are_no_evidence():
    """On average over signs that are drawn, odds are one: a ratio of likelihoods."""
    rng = np.random.default_rng(4)
    same = rng.binomial(12, 0.5, 20_000)
    odds = np.exp([log_sign_odds(int(s), 12) for s in same])
    assert np.mean(odds) == pytest.approx(1.0, abs=0.15)


def test_what_is_passed_over_as_hopeless_changes_nothing(monkeypatch):
    """Beside a strong effect bursts are looked for beside few others."""
    case = simulated(rich(), {"coulomb_friction": {"force": 2.0}}, seed=5)
    looked, odds = [], bursts.burst_odds

    def counted(*given):
        looked.append(given[1])
        return odds(*given)

    monkeypatch.setattr(bursts, "burst_odds", counted)
    few, count = judged(case).which.probabilities, len(looked)
    monkeypatch.setattr(bursts, "_HOPELESS", -np.inf)
    all_of_them = judged(case).which.probabilities
    assert 0 < count < (len(looked) - count) / 2
    assert all_of_them == pytest.approx(few, abs=1e-9)
