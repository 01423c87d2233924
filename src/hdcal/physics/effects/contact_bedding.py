"""Contacts in series with the gear that close under load: soft first, then hard."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter

# Rounding radius of |ω| at zero [mm], far below any reading.
_CORNER = 1e-4


class ContactBedding(Effect):
    """ω = ω_g + δ(k ω_g), δ(F) = c F/(F + P): half closed at F = P.

    Solved for ω_g, which the gear sees; tension mirrors compression.

    Source: Bandis, Lumsden and Barton (1983), hyperbolic closure of a joint.
    """

    name: ClassVar[str] = "contact_bedding"
    stage: ClassVar[Stage] = "deformation"
    groups: ClassVar[tuple[str, ...]] = ("curve up",)
    acts_at_once: ClassVar[bool] = True

    closure: Float[Array, ""] | float = parameter(
        "mm", "radial closure of the contacts when fully bedded", typical=0.03, null=0.0
    )
    load: Float[Array, ""] | float = parameter(
        "N", "force at which half of the closure is used up", typical=20.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the share of the deformation that the contacts leave to the gear."""
        depth = jnp.sqrt(signal**2 + _CORNER**2)
        # In ω_g a parabola, k ω_g² − (k (|ω| − c) − P) ω_g − |ω| P = 0; its positive
        # root in the form that needs no division by k.
        left = rows.stiffness * (depth - self.closure) - self.load
        root = jnp.sqrt(left**2 + 4.0 * rows.stiffness * depth * self.load)
        return signal * 2.0 * self.load / (root - left)
