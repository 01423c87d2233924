"""Drag that grows with the speed of loading."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class ViscousDamping(Effect):
    """F → F + c dω/dt, with the rate as read.

    Source: handbook (linear viscous damping of the Kelvin-Voigt solid).
    """

    name: ClassVar[str] = "viscous_damping"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("rate or time",)
    needs: ClassVar[frozenset[str]] = frozenset({"rates"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "none"
    acts_at_once: ClassVar[bool] = True

    coefficient: Float[Array, ""] | float = parameter(
        "N*s/mm", "drag per rate of deformation", typical=6.0, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the drag added."""
        return signal + self.coefficient * rows.records.rate
