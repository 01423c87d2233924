"""The leftover discrepancy: a smooth function of deformation, orthogonal to the base.

A Gaussian process in the Hilbert-space approximation. Its basis is projected off
the columns of the linear core at the tested rows, so that it cannot take anything
that stiffness and offsets can explain.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpyro.contrib.hsgp.laplacian import eigenfunctions
from numpyro.contrib.hsgp.spectral_densities import (
    diag_spectral_density_squared_exponential,
)

from hdcal.rig.records import Array

# Number of eigenfunctions and half-width of their interval, in half-ranges of the
# tested deformation: enough for length-scales down to a tenth of the range.
BASIS_SIZE = 20
BOUNDARY = 2.0


class Gap(eqx.Module):
    """Where the discrepancy lives, and what was projected off its basis.

    Attributes:
        centre: middle of the tested deformation [mm].
        half_range: half the tested range [mm].
        absorbed: coefficients of the base columns in each basis function [N].
    """

    centre: float
    half_range: float
    absorbed: Float[Array, "4 m"]

    def columns(
        self, deformation: Float[Array, " n"], base_columns: Float[Array, "n 4"]
    ) -> Float[Array, "n m"]:
        """Return the projected basis at any rows, tested or not."""
        return _basis(deformation, self.centre, self.half_range) - (
            base_columns @ self.absorbed
        )


def _basis(deformation, centre, half_range):
    # Beyond the interval the eigenfunctions would repeat; hold them at its end.
    scaled = jnp.clip((deformation - centre) / half_range, -BOUNDARY, BOUNDARY)
    return eigenfunctions(scaled, BOUNDARY, BASIS_SIZE)


def build_gap(deformation, base_columns) -> Gap:
    """Project the basis off the base columns at the tested rows.

    Args:
        deformation: as read [mm], shape (n,).
        base_columns: columns of the linear core, shape (n, 4).
    """
    low, high = float(np.min(deformation)), float(np.max(deformation))
    centre, half_range = (low + high) / 2.0, (high - low) / 2.0
    basis = np.asarray(_basis(deformation, centre, half_range))
    absorbed = np.linalg.lstsq(np.asarray(base_columns), basis, rcond=1e-10)[0]
    return Gap(centre, half_range, absorbed)


def prior_sd(sd, length) -> Float[Array, " m"]:
    """Return the prior sd of the basis weights [N].

    Args:
        sd: of the discrepancy [N].
        length: length-scale as a share of the tested range [-].
    """
    density = diag_spectral_density_squared_exponential(
        sd**2, 2.0 * length, BOUNDARY, BASIS_SIZE, 1
    )
    # The highest frequencies underflow to zero, where the root has no derivative.
    return jnp.sqrt(density + 1e-200)
