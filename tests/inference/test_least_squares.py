"""Where a straight line is right, the posterior is that of least squares."""

import numpy as np
import pytest
from scipy import stats

import hdcal

SPRING = {
    "name": "spring",
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}


def stiffness(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    case = hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=SPRING)
    posterior = hdcal.calibrate(case, draws=5000)
    assert posterior.usable
    return np.asarray(posterior.draws["stiffness"]).ravel()


@pytest.mark.parametrize("rows", [15, 40, 400])
@pytest.mark.parametrize("origin", [0.0, -3.0, 80.0])
def test_stiffness_and_interval_are_those_of_least_squares(rows: int, origin: float):
    rng = np.random.default_rng(rows)
    x = np.linspace(0.0, 2.0, rows) + origin
    y = 50.0 * (x - origin) - 7.0 + rng.normal(0.0, 1.0, rows)
    line = stats.linregress(x, y)
    half = stats.t.ppf(0.975, rows - 2) * line.stderr
    ends = np.quantile(stiffness(x, y), [0.025, 0.5, 0.975])
    expected = line.slope + half * np.array([-1.0, 0.0, 1.0])
    # Ends of 20,000 draws have a Monte Carlo error of half a per cent of the width.
    np.testing.assert_allclose(ends, expected, atol=0.02 * 2.0 * half)


@pytest.mark.parametrize(
    ("scale_x", "scale_y", "shift_x", "shift_y"),
    [(1e3, 1.0, 0.0, 0.0), (1.0, 1e4, 0.0, 0.0), (1.0, 1.0, 100.0, -500.0)],
)
def test_scale_and_origin_of_both_channels_change_nothing(
    scale_x: float, scale_y: float, shift_x: float, shift_y: float
):
    rng = np.random.default_rng(5)
    x = np.linspace(0.0, 0.5, 30)
    y = 200.0 * x + rng.normal(0.0, 1.5, 30)
    known = np.quantile(stiffness(x, y), [0.025, 0.5, 0.975])
    moved = stiffness(scale_x * x + shift_x, scale_y * y + shift_y)
    found = np.quantile(moved, [0.025, 0.5, 0.975]) * scale_x / scale_y
    np.testing.assert_allclose(found, known, atol=0.03 * float(known[2] - known[0]))


def test_the_order_of_rows_at_one_deformation_changes_nothing():
    rng = np.random.default_rng(6)
    x = np.repeat(np.linspace(0.0, 0.5, 12), 4)
    y = 200.0 * x + rng.normal(0.0, 1.5, 48)
    mixed = y.reshape(12, 4)[:, ::-1].ravel()
    known, found = (
        np.quantile(stiffness(x, values), [0.025, 0.5, 0.975]) for values in (y, mixed)
    )
    np.testing.assert_allclose(found, known, atol=0.03 * float(known[2] - known[0]))


def test_thinning_widens_the_interval_as_it_must():
    """Of every fourth row the sd is twice as large, and the medians agree within it."""
    rng = np.random.default_rng(7)
    x = np.linspace(0.0, 0.5, 400)
    y = 200.0 * x + rng.normal(0.0, 1.5, 400)
    whole, thinned = stiffness(x, y), stiffness(x[::4], y[::4])
    assert np.std(thinned) / np.std(whole) == pytest.approx(2.0, rel=0.2)
    assert abs(np.median(thinned) - np.median(whole)) < 2.0 * np.std(thinned)
