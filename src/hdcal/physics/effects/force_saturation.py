"""A force sensor that reads less and less of a large force."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter

# Below this x the series of tanh(√x)/√x, cut after x³, is exact in double precision.
_SMALL = 1e-3


class ForceSaturation(Effect):
    """F → F_s tanh(F/F_s) = F (1 − h F² + …), written in h = 1/(3 F_s²).

    The loss of reading is h F² to first order, so it grows in proportion to h;
    in 1/F_s it would have no slope at none.

    Source: handbook (odd compressive characteristic of an amplifier near its limit).
    """

    name: ClassVar[str] = "force_saturation"
    stage: ClassVar[Stage] = "sensor"
    groups: ClassVar[tuple[str, ...]] = ("curve down",)

    curvature: Float[Array, ""] | float = parameter(
        "1/N^2",
        "relative loss of reading per square of the force",
        typical=8e-7,
        null=0.0,
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force as the saturating sensor shows it."""
        x = 3.0 * self.curvature * signal**2
        small = x < _SMALL
        root = jnp.sqrt(jnp.where(small, 1.0, x))
        series = 1.0 - x * (1 / 3 - x * (2 / 15 - x * (17 / 315 - x * (62 / 2835))))
        return signal * jnp.where(small, series, jnp.tanh(root) / root)
