"""Stiffness that grows with deformation: the contact line moves, teeth bed in."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter

# Rounding radius of |ω| at zero [mm], far below any reading.
_CORNER = 1e-4


class ProgressiveStiffening(Effect):
    """F → F + k ω · a |ω|: tangent stiffness k (1 + 2 a |ω|).

    Source: handbook (first-order hardening of a contact whose lever shortens).
    """

    name: ClassVar[str] = "progressive_stiffening"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("curve up",)
    acts_at_once: ClassVar[bool] = True

    slope: Float[Array, ""] | float = parameter(
        "1/mm", "relative gain of secant stiffness per mm", typical=0.4, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the gain added."""
        depth = jnp.sqrt(rows.deformation**2 + _CORNER**2) - _CORNER
        return signal + rows.stiffness * rows.deformation * self.slope * depth
