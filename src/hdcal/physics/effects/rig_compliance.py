"""A rig that gives way itself: its stretch is read as deformation of the gear."""

from typing import ClassVar

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class RigCompliance(Effect):
    """ω → ω/(1 + c k): springs in series, 1/k_read = 1/k + c.

    Source: handbook (machine compliance, ISO 14577-1).
    """

    name: ClassVar[str] = "rig_compliance"
    stage: ClassVar[Stage] = "deformation"
    groups: ClassVar[tuple[str, ...]] = ("rig",)
    # No table of readings on the gear holds it, so nothing here is ever tested:
    # the readings are those of a softer gear.
    needs: ClassVar[frozenset[str]] = frozenset({"bare_rig"})
    acts_at_once: ClassVar[bool] = True

    compliance: Float[Array, ""] | float = parameter(
        "mm/N", "stretch of rig and fixture per force", typical=2.5e-4, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return what the rig leaves to the gear."""
        return signal / (1.0 + self.compliance * rows.stiffness)
