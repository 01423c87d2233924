"""The gap is a smooth Gaussian process that takes nothing from the base."""

import jax
import numpy as np
import pytest

from hdcal.inference.discrepancy import (
    BASIS_SIZE,
    Discrepancy,
    build_discrepancy,
    prior_sd,
)


def test_the_gap_takes_no_offset_and_no_slope(loading):
    gap = build_discrepancy(loading.deformation)
    basis = np.asarray(gap.columns(loading.deformation))
    assert basis.shape == (180, BASIS_SIZE)
    line = np.column_stack([np.ones(180), loading.deformation])
    norms = np.linalg.norm(line, axis=0)[:, None] * np.linalg.norm(basis, axis=0)
    assert np.max(np.abs(line.T @ basis) / norms) < 1e-10
    # It is not empty: what is left bends.
    assert np.linalg.matrix_rank(basis, tol=1e-6) > 8


def kernel_error(length, project):
    """Return the largest error of the approximate kernel, as a share of sd²."""
    deformation, sd = np.linspace(0.02, 0.54, 27), 1.7
    gap = Discrepancy(0.28, 0.26, np.zeros((2, BASIS_SIZE)))
    basis = np.asarray(gap.columns(deformation))
    approximate = (basis * np.asarray(prior_sd(sd, length)) ** 2) @ basis.T
    distance = deformation[:, None] - deformation
    # A length-scale is a share of the whole tested range.
    exact = sd**2 * np.exp(-0.5 * (distance / (length * 0.52)) ** 2)
    line = np.stack([np.ones(27), deformation], axis=1)
    off = np.eye(27) - project * line @ np.linalg.pinv(line)
    return np.max(np.abs(off @ (approximate - exact) @ off)) / sd**2


@pytest.mark.parametrize("length", [0.1, 0.15, 0.2, 0.3])
def test_the_gap_has_a_squared_exponential_kernel(length):
    # The boundary at two half-ranges is right up to 2/3.2 half-ranges, 0.31.
    assert kernel_error(length, project=0.0) < 5e-3


@pytest.mark.parametrize("length", [0.1, 0.3, 0.6, 1.0, 2.0])
def test_what_bends_has_the_right_kernel_at_any_length(length):
    # Beyond that the missing part is nearly straight, which the base explains anyway.
    assert kernel_error(length, project=1.0) < 2e-2


def test_the_gaps_prior_has_a_slope_everywhere():
    slopes = jax.jacfwd(prior_sd, argnums=(0, 1))(1.0, 2.0)
    assert np.isfinite(slopes).all()
