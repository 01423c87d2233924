"""Beside the number stands what may move it farther than its interval."""

import numpy as np
import pytest

import hdcal

UP = np.linspace(0.0, 0.45, 30)
PATH = np.concatenate([UP, UP[-2::-1]])
OUTSIDE = "it may lie outside"


@pytest.mark.thorough
@pytest.mark.parametrize("width", [0.0, 2.0])
def test_a_loop_that_the_model_lacks_is_said_in_the_headline(width: float):
    way = np.where(np.arange(len(PATH)) < len(UP), 0.5, -0.5)
    noise = 0.2 * np.random.default_rng(3).normal(size=len(PATH))
    force = 108.0 * PATH + width * way + noise
    case = hdcal.read_case({"deformation_mm": PATH, "force_N": force})
    found = hdcal.summarise(hdcal.calibrate(case, warmup=500, draws=500))
    assert (OUTSIDE in found["headline"]) == bool(width)
