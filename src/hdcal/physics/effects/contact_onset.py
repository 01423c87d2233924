"""A second contact that closes at some deformation and stiffens the gear."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter

# The corner is rounded over this share of the onset, and no less than [mm].
_ROUNDED, _LEAST = 0.02, 1e-4


class ContactOnset(Effect):
    """F → F + k₂ max(0, |ω| − ω_c) sign ω, k₂ = r k, with a rounded corner.

    Source: handbook (bilinear spring of a stop that closes a gap).
    """

    name: ClassVar[str] = "contact_onset"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("curve up",)
    acts_at_once: ClassVar[bool] = True

    ratio: Float[Array, ""] | float = parameter(
        "1",
        "stiffness of the second contact over that of the gear",
        typical=0.5,
        null=0.0,
    )
    onset: Float[Array, ""] | float = parameter(
        "mm", "deformation at which the contact closes", typical=0.25
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with that of the second contact added."""
        width = jnp.sqrt((_ROUNDED * self.onset) ** 2 + _LEAST**2)

        def beyond(depth):
            return 0.5 * (depth + jnp.sqrt(depth**2 + width**2))

        # Two opposed ramps: odd, and smooth through zero.
        travel = beyond(rows.deformation - self.onset)
        travel = travel - beyond(-rows.deformation - self.onset)
        return signal + self.ratio * rows.stiffness * travel
