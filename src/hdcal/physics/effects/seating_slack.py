"""Play that is taken up before the gear feels the load."""

from typing import ClassVar

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter

# Smallest clearance that is told from none [mm]; keeps the gradient finite at rest.
_NEGLIGIBLE = 1e-6


class SeatingSlack(Effect):
    """Dead zone of the deformation, ω → ω − ω_c clip(ω/ω_c, −1, 1), smoothed.

    For ω > 0 this is max(0, ω − ω_c). The clip is x (1 + x⁸)^(−1/8): smooth, and a
    third of a clearance away from the corner within 1.2 % of a clearance of it.

    Source: handbook (play of a bolted or seated joint).
    """

    name: ClassVar[str] = "seating_slack"
    stage: ClassVar[Stage] = "deformation"
    groups: ClassVar[tuple[str, ...]] = ("curve up",)
    acts_at_once: ClassVar[bool] = True

    clearance: Float[Array, ""] | float = parameter(
        "mm", "radial play taken up before contact", typical=0.02, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return what is left of the deformation after the play."""
        eighth = signal**8 + self.clearance**8 + _NEGLIGIBLE**8
        return signal - self.clearance * signal / eighth**0.125
