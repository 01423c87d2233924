"""The leftover discrepancy: a smooth function of deformation, orthogonal to the base.

A Gaussian process in the Hilbert-space approximation. Its basis is projected off
an offset and a slope at the tested rows, so that it cannot take anything that
stiffness and offsets can explain. Where loading and unloading were tested, half their
difference is another such function. It knows no temperature.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from numpyro.contrib.hsgp.laplacian import eigenfunctions
from numpyro.contrib.hsgp.spectral_densities import (
    diag_spectral_density_squared_exponential,
)

from hdcal.data.records import Array, Records
from hdcal.inference.padding import bucket_size, repeat_last_row

# Number of eigenfunctions and half-width of their interval, in half-ranges of the
# tested deformation: enough for length-scales down to a tenth of the range.
BASIS_SIZE = 20
# The first of them are enough for half a loop, which is smooth between its turns.
LOOP_SIZE = 8
BOUNDARY = 2.0


class Discrepancy(eqx.Module):
    """Where the discrepancy lives, and what was projected off its basis.

    Attributes:
        centre: middle of the tested deformation [mm].
        half_range: half the tested range [mm].
        absorbed: offset and slope in each basis function.
        directed: whether loading and unloading may differ, where both were tested.
    """

    centre: float
    half_range: float
    absorbed: Float[Array, "2 m"]
    directed: bool = eqx.field(static=True, default=False)

    @property
    def size(self) -> int:
        """Number of weights."""
        return leftover_size(self.directed)

    def columns(
        self, deformation: Float[Array, " n"], movement: Float[Array, " n"]
    ) -> Float[Array, "n m"]:
        """Return the projected basis at any deformations, tested or not.

        Where loading and unloading may differ, half the loop has an offset and a slope
        of its own: these the base model cannot explain.

        Args:
            deformation: as read [mm].
            movement: +1 where it rises, −1 where it falls, 0 for the mean of both.
        """
        scaled = (jnp.asarray(deformation) - self.centre) / self.half_range
        smooth = _basis(scaled) - _line(scaled) @ self.absorbed
        if not self.directed:
            return smooth
        half = jnp.concatenate([_line(scaled), smooth[:, :LOOP_SIZE]], axis=1)
        half = jnp.asarray(movement)[:, None] * half
        return jnp.concatenate([smooth, half], axis=1)

    def prior_sd(self, sd, length) -> Float[Array, " m"]:
        """Return the prior sd of the weights [N], as `prior_sd` those of one basis."""
        own = prior_sd(sd, length)
        if not self.directed:
            return own
        return jnp.concatenate([own, jnp.full(2, sd), own[:LOOP_SIZE]])


def leftover_size(directed: bool) -> int:
    """Return the number of weights of a discrepancy."""
    return BASIS_SIZE + (2 + LOOP_SIZE) * directed


def is_directed(records: Records) -> bool:
    """Tell whether both loading and unloading were tested."""
    return "unloading" in records.known


def _basis(scaled):
    # Beyond the interval the eigenfunctions would repeat; hold them at its end.
    return eigenfunctions(jnp.clip(scaled, -BOUNDARY, BOUNDARY), BOUNDARY, BASIS_SIZE)


def _line(scaled):
    return jnp.stack([jnp.ones_like(scaled), scaled], axis=1)


def build_discrepancy(records: Records) -> Discrepancy:
    """Project the basis off an offset and a slope at the tested rows."""
    deformation = np.asarray(records.deformation)
    low, high = float(np.min(deformation)), float(np.max(deformation))
    centre, half_range = (low + high) / 2.0, (high - low) / 2.0
    rows = len(deformation)
    padded = repeat_last_row(deformation, bucket_size(rows))
    scaled = (padded - centre) / half_range
    line, basis = np.asarray(_line(scaled))[:rows], np.asarray(_basis(scaled))[:rows]
    absorbed = np.linalg.lstsq(line, basis, rcond=None)[0]
    return Discrepancy(centre, half_range, absorbed, is_directed(records))


def discrepancy_columns(
    discrepancy: Discrepancy | None, records: Records
) -> np.ndarray | None:
    """Return the projected basis at padded rows; None without a discrepancy.

    Args:
        discrepancy: of the problem, or None.
        records: of a bucket's length.
    """
    if discrepancy is None:
        return None
    return np.asarray(discrepancy.columns(records.deformation, records.sense))


def prior_sd(sd, length) -> Float[Array, " m"]:
    """Return the prior sd of the weights of one basis [N].

    Args:
        sd: of the discrepancy [N].
        length: length-scale as a share of the tested range [-].
    """
    density = diag_spectral_density_squared_exponential(
        sd**2, 2.0 * length, BOUNDARY, BASIS_SIZE, 1
    )
    # The highest frequencies underflow to zero, where the root has no derivative.
    return jnp.sqrt(density + 1e-200)
