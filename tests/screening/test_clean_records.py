"""A record without a fault gives no finding."""

from pathlib import Path

import numpy as np
import pytest
from benchmarks.springs.clean import KINDS, NOISES, clean_record

import hdcal
from hdcal.screening.screen import screen

DATASETS = sorted(Path("datasets").glob("*/data.csv"))


@pytest.mark.parametrize("data", DATASETS, ids=lambda path: path.parent.name)
def test_bundled_datasets_are_clean(data):
    found = hdcal.read_case(data.parent).screening
    assert found is not None
    assert found.observations == ()
    assert found.kept.all()
    assert not found.trembling


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("kind", KINDS)
def test_simulated_clean_records_are_clean(kind, noise):
    """The rate is some per mille (`python -m benchmarks.springs.screening`)."""
    alarms = 0
    for seed in range(6):
        record = clean_record(np.random.default_rng([seed, 1]), kind, noise)
        found = screen(record.deformation, record.force, record.run)
        alarms += bool(found.observations)
    assert alarms <= 1
