"""Sums over mountings give the least-squares fits of all rows."""

from dataclasses import replace

import numpy as np
import pytest
from gear_rows import RUNS, SENSE, GearRows, X, bend_shape, ordinary

from hdcal.fleets.model.line_fits import line_fits


def rows_of(seed: int, gears: int = 3) -> GearRows:
    return ordinary(gears, np.random.default_rng(seed))


def fits_of(rows: GearRows, seed: int = 0, step: float = 0.0):
    readings = rows.readings(np.random.default_rng(seed))
    return line_fits(readings.sums, np.zeros(len(readings.sums.gear), int), step)


def test_exact_curves_give_their_parameters():
    rows = rows_of(1)
    rows.noise = 0.0 * rows.noise
    found = fits_of(rows, step=0.01)
    np.testing.assert_allclose(found.slope, rows.stiffness, rtol=1e-9)
    np.testing.assert_allclose(found.loop, rows.loop, rtol=1e-6)
    np.testing.assert_allclose(found.bend, rows.bend, rtol=1e-6)
    # What the display rounds is left of an exact curve.
    np.testing.assert_allclose(np.exp(found.log_sd), 0.01 / np.sqrt(12.0), rtol=1e-6)


def test_fits_are_those_of_numpy():
    """Against one regression of all rows of a gear, with a zero for each mounting."""
    rows = rows_of(2)
    readings = rows.readings(np.random.default_rng(5))
    found = line_fits(readings.sums, np.zeros(len(readings.sums.gear), int))
    # The same forces again, by the same random numbers.
    noise = np.random.default_rng(5).standard_normal((3 * RUNS, len(X)))
    for gear in range(3):
        force = np.concatenate(
            [
                rows.stiffness[gear] * X
                + rows.zero[gear, run]
                + 0.5 * rows.loop[gear] * SENSE
                + rows.bend[gear] * bend_shape()
                + rows.noise[gear] * noise[RUNS * gear + run]
                for run in range(RUNS)
            ]
        )
        many = np.kron(np.eye(RUNS), np.ones((len(X), 1)))
        line = np.column_stack([np.tile(X, RUNS), many])
        curve = np.column_stack(
            [line, np.tile(SENSE, RUNS), np.tile(bend_shape(), RUNS)]
        )
        slope = np.linalg.lstsq(line, force, rcond=None)[0][0]
        whole, square = np.linalg.lstsq(curve, force, rcond=None)[:2]
        error = np.linalg.inv(curve.T @ curve)
        assert found.slope[gear] == pytest.approx(slope, rel=1e-10)
        assert found.loop[gear] == pytest.approx(2.0 * whole[-2], rel=1e-8)
        assert found.bend[gear] == pytest.approx(whole[-1], rel=1e-8)
        assert found.loop_error[gear] == pytest.approx(4.0 * error[-2, -2], rel=1e-8)
        assert found.bend_error[gear] == pytest.approx(error[-1, -1], rel=1e-8)
        free = len(force) - curve.shape[1]
        assert found.freedom[gear] == free
        sd = np.sqrt(square[0] / free)
        assert np.exp(found.log_sd[gear]) == pytest.approx(sd, rel=1e-8)


def test_neighbours_that_err_alike_widen_the_errors():
    rows = rows_of(3, gears=40)
    assert fits_of(rows).correlation == 0.0
    readings = rows.readings(np.random.default_rng(0))
    # A drift that no curve holds.
    sums = readings.sums
    drift = np.cumsum(np.random.default_rng(1).standard_normal(len(X)))
    drift -= drift.mean()
    products, lagged = sums.products.copy(), sums.lagged.copy()
    products[:, 3, 3] += drift @ drift
    lagged[:, 3, 3] += drift[1:] @ drift[:-1]
    found = line_fits(
        replace(sums, products=products, lagged=lagged), np.zeros(len(sums.gear), int)
    )
    rho = found.correlation
    assert rho > 0.4
    xx = RUNS * np.sum((X - X.mean()) ** 2)
    np.testing.assert_allclose(found.slope_error, (1 + rho) / (1 - rho) / xx)
