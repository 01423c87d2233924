"""A grid of readings is found however they were written, and where there is one."""

import numpy as np
import pytest

from hdcal.evidence.quantisation import rounding_step

STEPS = (3.696263, 0.98, 1.0 / 3.0, 17.23, 0.0217)
FORMS = (".5g", ".6g", ".7g", ".4f", ".5f")


def written(readings: np.ndarray, form: str) -> np.ndarray:
    return np.array([float(format(reading, form)) for reading in readings])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize("lowest", [0.0, -60.0])
def test_a_grid_is_found(step: float, form: str, lowest: float):
    rng = np.random.default_rng(1)
    free = step * (lowest + np.linspace(0.0, 130.0, 200) + rng.normal(size=200))
    found, _ = rounding_step(written(step * np.round(free / step), form), 0.5 * step)
    assert found == pytest.approx(step, rel=1e-5)
    assert rounding_step(written(free, form), 0.5 * step)[0] == 0.0


def test_the_converters_of_the_files_that_were_missed():
    """Steps of 3.696 as C, MATLAB and NumPy write them: 3.69626, 18.4813, 70.229."""
    readings = np.array([3.69626, 18.4813, 70.229, 7.39253, 11.0888, 73.9253])
    assert rounding_step(readings, 2.0)[0] == pytest.approx(3.696263, rel=1e-5)
