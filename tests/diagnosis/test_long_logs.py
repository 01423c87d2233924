"""A log of many thousand rows is diagnosed, and calibrated on some of its rows."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import cycles, make_case

from hdcal.diagnosis import diagnose
from hdcal.diagnosis.diagnose import _fitted

LONG = make_case(cycles(12_000))


def test_rows_that_are_calibrated_on_are_single_ones_and_keep_the_turns():
    few = _fitted(LONG, 4)
    rows = len(few.records.force)
    assert 3_000 <= rows <= 3_100
    assert set(np.asarray(few.records.force)) <= set(np.asarray(LONG.records.force))
    assert np.max(few.records.deformation) == np.max(LONG.records.deformation)
    assert few.notes[-1] == f"{rows} of 12000 rows were calibrated on, turns kept"
    # Where all of them were diagnosed there are still no more than can be calibrated.
    assert len(_fitted(LONG, 1).records.force) <= 5_100
    short = make_case(cycles(100))
    assert _fitted(short, 3) is short


@pytest.mark.thorough
def test_a_long_log_is_said_to_be_calibrated_on_some_rows():
    rng = np.random.default_rng(4)
    records = cycles(6_000)
    loop = 2.0 * np.sign(np.asarray(records.sense))
    force = 195.0 * records.deformation + loop + rng.normal(0.0, 0.3, 6_000)
    verdict = diagnose.diagnose(make_case(replace(records, force=force)))
    assert any("rows were calibrated on" in note for note in verdict.notes)
    for _, posterior in verdict.posteriors.values():
        assert len(posterior.case.records.force) < 5_100
        # Noise of a reading, not of a mean of several.
        assert np.median(posterior.draws["sigma"]) == pytest.approx(0.3, rel=0.1)
