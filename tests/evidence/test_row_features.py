"""The step of a coarse reading is found in the digits."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated

from hdcal.evidence.row_features import coarse_step, with_coarse_step


def read(step: float, digits: int, scale: float = 1.0):
    """Return a case with forces that were rounded to a step, then to digits."""
    case = simulated(rich(), seed=5)
    force = scale * np.asarray(case.records.force)
    force = step * np.round(force / step) if step else force
    return replace(case, records=replace(case.records, force=np.round(force, digits)))


@pytest.mark.parametrize(
    ("step", "digits", "scale"),
    [(1.2345, 6, 1.0), (0.9417, 3, 1.0), (12.362, 1, 20.0), (0.5, 2, 1.0)],
)
def test_the_step_is_found(step: float, digits: int, scale: float):
    found = coarse_step(with_coarse_step(read(step, digits, scale)), scale * NOISE)
    assert found == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize("digits", [1, 2, 3, 9])
def test_digits_finer_than_the_noise_are_no_step(digits: int):
    assert coarse_step(with_coarse_step(read(0.0, digits)), NOISE) == 0.0
