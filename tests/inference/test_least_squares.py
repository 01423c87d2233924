"""Where a straight line is right, the posterior is that of least squares."""

from functools import partial

import numpy as np
import pytest
from scipy import stats

import hdcal

LATER = partial(pytest.param, marks=pytest.mark.thorough)
X = np.linspace(0.0, 0.5, 30)
Y = 200.0 * X + np.random.default_rng(5).normal(0.0, 1.5, 30)
SPRING = {
    "name": "spring",
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def stiffness(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    case = hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=SPRING)
    posterior = hdcal.calibrate(case, warmup=300, draws=20_000)
    assert posterior.usable
    return np.asarray(posterior.draws["stiffness"]).ravel()


@pytest.mark.parametrize(
    ("rows", "origin"), [(15, 0.0), (400, -3e4), LATER(15, 80.0), LATER(40, -3.0)]
)
def test_stiffness_and_interval_are_those_of_least_squares(rows: int, origin: float):
    rng = np.random.default_rng(rows)
    x = np.linspace(0.0, 2.0, rows) + origin
    y = 50.0 * (x - origin) - 7.0 + rng.normal(0.0, 1.0, rows)
    line = stats.linregress(x, y)
    half = stats.t.ppf(0.975, rows - 2) * line.stderr
    ends = np.quantile(stiffness(x, y), [0.025, 0.5, 0.975])
    expected = line.slope + half * np.array([-1.0, 0.0, 1.0])
    # Of 80,000 draws a fourth are effective: ends err by 0.5 % of the width (sd).
    np.testing.assert_allclose(ends, expected, atol=0.02 * 2.0 * half)


@pytest.fixture(scope="module")
def known() -> np.ndarray:
    return np.quantile(stiffness(X, Y), [0.025, 0.5, 0.975])


@pytest.mark.parametrize(
    ("scale_x", "scale_y", "shift_x", "shift_y"),
    [(1e3, 1e4, 0.0, 0.0), (1.0, 1.0, 100.0, -500.0)],
)
def test_scale_and_origin_of_both_channels_change_nothing(
    scale_x: float, scale_y: float, shift_x: float, shift_y: float, known
):
    moved = stiffness(scale_x * X + shift_x, scale_y * Y + shift_y)
    found = np.quantile(moved, [0.025, 0.5, 0.975]) * scale_x / scale_y
    # As above, of both.
    np.testing.assert_allclose(found, known, atol=0.03 * float(known[2] - known[0]))
