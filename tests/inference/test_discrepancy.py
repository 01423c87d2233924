"""The gap is a smooth Gaussian process that takes nothing from the base."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from hdcal.inference.force_model.discrepancy import (
    BASIS_SIZE,
    Discrepancy,
    build_discrepancy,
    prior_sd,
)
from hdcal.physics.registry import EFFECTS


def unequal(records):
    """Return the same rows, the later ones of unloading struck out."""
    kept = np.flatnonzero((records.sense > 0.0) | (records.deformation > 0.45))
    rows = {
        name: np.asarray(column)[kept]
        for name, column in vars(records).items()
        if np.shape(column) == np.shape(records.force)
    }
    return replace(records, **rows)


@pytest.mark.parametrize("tested", ["both ways alike", "little unloading", "ramp"])
def test_the_gap_takes_no_offset_and_no_slope(loading, tested):
    records = loading
    if tested == "little unloading":
        records = unequal(loading)
    elif tested == "ramp":
        records = replace(loading, known=loading.known - {"unloading"})
    gap = build_discrepancy(records)
    assert gap.directed == (tested != "ramp")
    basis = np.asarray(gap.columns(records.deformation, records.sense))
    count = len(records.force)
    assert basis.shape == (count, gap.size)
    line = np.column_stack([np.ones(count), records.deformation])
    norms = np.linalg.norm(line, axis=0)[:, None] * np.linalg.norm(basis, axis=0)
    np.testing.assert_allclose(line.T @ basis / norms, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "looped"),
    [("coulomb_friction", False), ("hysteresis", False), ("thermal_zero_drift", True)],
)
def test_with_an_effect_that_draws_loops_the_gap_has_none(loading, name, looped):
    """Else the effect's size would be the discrepancy's to choose."""
    gap = build_discrepancy(loading, [EFFECTS[name]])
    place, up = np.linspace(0.02, 0.54, 9), np.ones(9)
    rising, falling = (np.asarray(gap.columns(place, way * up)) for way in (1.0, -1.0))
    assert gap.looped == looped
    assert (np.max(np.abs(rising - falling)) > 0.1) == looped
    # Draws of several models are joined in one table.
    assert gap.size == build_discrepancy(loading).size


@pytest.mark.parametrize("length", [0.1, 0.6, 2.0])
def test_what_bends_has_a_squared_exponential_kernel(length):
    """Up to what is nearly straight, which the base explains anyway."""
    deformation, sd = np.linspace(0.02, 0.54, 27), 1.7
    gap = Discrepancy(0.28, 0.26, np.zeros((2, BASIS_SIZE)))
    basis = np.asarray(gap.columns(deformation, np.ones(27)))
    approximate = (basis * np.asarray(prior_sd(sd, length)) ** 2) @ basis.T
    distance = deformation[:, None] - deformation
    # A length-scale is a share of the whole tested range.
    exact = sd**2 * np.exp(-0.5 * (distance / (length * 0.52)) ** 2)
    line = np.stack([np.ones(27), deformation], axis=1)
    off = np.eye(27) - line @ np.linalg.pinv(line)
    assert np.max(np.abs(off @ (approximate - exact) @ off)) < 2e-2 * sd**2


def test_the_gaps_prior_has_a_slope_everywhere():
    slopes = jax.jit(jax.jacfwd(prior_sd, argnums=(0, 1)))(1.0, 2.0)
    assert np.isfinite(slopes).all()


def test_half_a_loop_has_an_offset_and_a_slope_of_its_own(loading):
    """The middle is that of a ramp; what loading adds unloading takes away."""
    assert "unloading" in loading.known
    ramp = build_discrepancy(replace(loading, known=loading.known - {"unloading"}))
    gap = build_discrepancy(loading)
    place, still = np.linspace(0.02, 0.54, 40), np.zeros(40)
    middle, up, down = (
        np.asarray(gap.columns(place, movement))
        for movement in (still, still + 1, still - 1)
    )
    assert gap.size == middle.shape[1] > ramp.size
    np.testing.assert_allclose(middle[:, : ramp.size], ramp.columns(place, still))
    np.testing.assert_allclose(up + down, 2.0 * middle, atol=1e-12)
    assert gap.looped and not ramp.looped
    half = up - middle
    wedge = np.column_stack([np.ones(40), place])
    left = wedge - half @ np.linalg.lstsq(half, wedge, rcond=None)[0]
    assert np.max(np.abs(left)) < 1e-9
    sd = np.asarray(gap.prior_sd(1.5, 0.3))
    np.testing.assert_allclose(sd[: ramp.size], prior_sd(1.5, 0.3))
    assert sd.shape == (gap.size,) and np.all(sd > 0.0)
