"""The discrepancy: a smooth function of deformation, orthogonal to the base model.

A Gaussian process in the Hilbert-space approximation. Its basis is projected off
an offset and a slope at the tested rows, so that it cannot explain what stiffness and
offsets can. Where loading and unloading were tested, half their difference is another
such function, unless the model contains an effect with hysteresis.
It does not depend on temperature.
"""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax import jit
from jaxtyping import Float

from hdcal.data.records import Array, Records
from hdcal.inference.force_model.padding import pad_records
from hdcal.physics.effect import Effect

# Number of eigenfunctions and half-width of their interval, in half-ranges of the
# tested deformation: enough for length-scales down to a tenth of the range.
BASIS_SIZE = 20
# Number of eigenfunctions of half a loop, which is smooth between its turns.
_LOOP_SIZE = 8
BOUNDARY = 2.0
# Covariates that an effect needs whose force depends on the direction of movement.
_DIRECTION = {"unloading", "rates"}


class Discrepancy(eqx.Module):
    """Functions of deformation, orthogonal to offset and slope at the tested rows."""

    # Of the tested deformation [mm].
    centre: float
    half_range: float
    # Offset and slope in each function, those of half a loop last.
    absorbed: Float[Array, "2 m"]
    directed: bool = eqx.field(static=True, default=False)
    # Factor of the half loop, 0 where the model contains an effect with hysteresis: the
    # size does not depend on the effects, as draws of several models are joined.
    loop: float = 1.0

    @property
    def size(self) -> int:
        """Number of weights."""
        return self.absorbed.shape[1]

    @property
    def looped(self) -> bool:
        """Whether loading and unloading differ."""
        return self.directed and float(self.loop) > 0.0

    def columns(
        self, deformation: Float[Array, " n"], movement: Float[Array, " n"]
    ) -> Float[Array, "n m"]:
        """Return the projected functions at any deformations as read [mm].

        The movement is +1 where it rises, −1 where it falls, 0 for the mean of both.
        """
        scaled = (jnp.asarray(deformation) - self.centre) / self.half_range
        line = jnp.stack([jnp.ones_like(scaled), scaled], axis=1)
        functions = _basis(scaled)
        if self.directed:
            half = jnp.concatenate([line, functions[:, :_LOOP_SIZE]], axis=1)
            half = jnp.asarray(movement)[:, None] * half
            functions = jnp.concatenate([functions, half], axis=1)
        # Multiplied last, so that nothing of an unused loop is left.
        used = jnp.where(jnp.arange(self.size) < BASIS_SIZE, 1.0, self.loop)
        return used * (functions - line @ self.absorbed)

    def prior_sd(self, sd, length) -> Float[Array, " m"]:
        """Return the prior sd of the weights [N], for an sd [N] and length-scale.

        The length-scale is a share of the tested range. Half a loop also has an offset
        and a slope, of the size of the discrepancy each.
        """
        smooth = prior_sd(sd, length)
        if not self.directed:
            return smooth
        return jnp.concatenate([smooth, jnp.full(2, sd), smooth[:_LOOP_SIZE]])


def build_discrepancy(
    records: Records, effects: Sequence[type[Effect]] = ()
) -> Discrepancy:
    """Project the functions off an offset and a slope at the tested rows.

    Half a loop is left out beside an effect that depends on the direction of movement.
    """
    deformation = np.asarray(records.deformation)
    low, high = float(np.min(deformation)), float(np.max(deformation))
    centre, half_range = (low + high) / 2.0, (high - low) / 2.0
    directed = "unloading" in records.known
    nothing = np.zeros((2, BASIS_SIZE + (2 + _LOOP_SIZE) * directed))
    raw = Discrepancy(centre, half_range, nothing, directed)
    functions = np.asarray(discrepancy_columns(raw, pad_records(records)))
    scaled = (deformation - centre) / half_range
    line = np.column_stack([np.ones_like(scaled), scaled])
    absorbed = np.linalg.lstsq(line, functions[: len(line)], rcond=None)[0]
    hysteresis = any(effect.needs & _DIRECTION for effect in effects)
    return replace(raw, absorbed=absorbed, loop=0.0 if hysteresis else 1.0)


def discrepancy_columns(
    discrepancy: Discrepancy | None, records: Records
) -> np.ndarray | None:
    """Return the projected basis at padded rows; None without a discrepancy."""
    if discrepancy is None:
        return None
    return np.asarray(_columns(discrepancy, records.deformation, records.sense))


@jit
def _columns(discrepancy: Discrepancy, deformation, movement):
    return discrepancy.columns(deformation, movement)


def _basis(scaled):
    from numpyro.contrib.hsgp.laplacian import eigenfunctions

    # Beyond the interval the eigenfunctions would repeat; hold them at its end.
    return eigenfunctions(jnp.clip(scaled, -BOUNDARY, BOUNDARY), BOUNDARY, BASIS_SIZE)


def prior_sd(sd, length) -> Float[Array, " m"]:
    """Return the prior sd of the weights of the smooth functions [N]; see above."""
    from numpyro.contrib.hsgp.spectral_densities import (
        diag_spectral_density_squared_exponential,
    )

    density = diag_spectral_density_squared_exponential(
        sd**2, 2.0 * length, BOUNDARY, BASIS_SIZE, 1
    )
    # The highest frequencies underflow to zero, where the root has no derivative.
    return jnp.sqrt(density + 1e-200)
