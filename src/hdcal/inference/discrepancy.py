"""The leftover discrepancy: a smooth function of deformation, orthogonal to the base.

A Gaussian process in the Hilbert-space approximation. Its basis is projected off
an offset and a slope at the tested rows, so that it cannot take anything that
stiffness and offsets can explain. It knows no temperature.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpyro.contrib.hsgp.laplacian import eigenfunctions
from numpyro.contrib.hsgp.spectral_densities import (
    diag_spectral_density_squared_exponential,
)

from hdcal.data.records import Array
from hdcal.inference.padding import bucket_size, repeat_last_row

# Number of eigenfunctions and half-width of their interval, in half-ranges of the
# tested deformation: enough for length-scales down to a tenth of the range.
BASIS_SIZE = 20
BOUNDARY = 2.0


class Discrepancy(eqx.Module):
    """Where the discrepancy lives, and what was projected off its basis.

    Attributes:
        centre: middle of the tested deformation [mm].
        half_range: half the tested range [mm].
        absorbed: offset and slope in each basis function.
    """

    centre: float
    half_range: float
    absorbed: Float[Array, "2 m"]

    def columns(self, deformation: Float[Array, " n"]) -> Float[Array, "n m"]:
        """Return the projected basis at any deformations, tested or not."""
        scaled = (jnp.asarray(deformation) - self.centre) / self.half_range
        return _basis(scaled) - _line(scaled) @ self.absorbed


def _basis(scaled):
    # Beyond the interval the eigenfunctions would repeat; hold them at its end.
    return eigenfunctions(jnp.clip(scaled, -BOUNDARY, BOUNDARY), BOUNDARY, BASIS_SIZE)


def _line(scaled):
    return jnp.stack([jnp.ones_like(scaled), scaled], axis=1)


def build_discrepancy(deformation: Float[Array, " n"]) -> Discrepancy:
    """Project the basis off an offset and a slope at the tested rows.

    Args:
        deformation: as read [mm].
    """
    low, high = float(np.min(deformation)), float(np.max(deformation))
    centre, half_range = (low + high) / 2.0, (high - low) / 2.0
    rows = len(deformation)
    padded = repeat_last_row(np.asarray(deformation), bucket_size(rows))
    scaled = (padded - centre) / half_range
    line, basis = np.asarray(_line(scaled))[:rows], np.asarray(_basis(scaled))[:rows]
    absorbed = np.linalg.lstsq(line, basis, rcond=None)[0]
    return Discrepancy(centre, half_range, absorbed)


def discrepancy_columns(
    discrepancy: Discrepancy | None, deformation: Float[Array, " n"]
) -> np.ndarray | None:
    """Return the projected basis at padded deformations; None without a discrepancy.

    Args:
        discrepancy: of the problem, or None.
        deformation: as read [mm], of a bucket's length.
    """
    if discrepancy is None:
        return None
    return np.asarray(discrepancy.columns(deformation))


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
