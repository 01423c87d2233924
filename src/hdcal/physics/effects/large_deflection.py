"""Geometry of a ring that is flattened: its lever arm grows, it turns softer."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter

# Series of the inextensible elastic ring under two opposed loads, in ω/R.
_FIRST, _SECOND = -1.543, 3.35


class LargeDeflection(Effect):
    """F → F + k ω (−1.543 κω + 3.35 (κω)²), κ = 1/R of the gear; κ = 0: straight.

    Compression (ω > 0) softens, tension stiffens: the loads' lever arm is half the
    width of the ring, which grows as the ring is flattened.

    Source: R. Frisch-Fay, Flexible Bars (1962), on thin rings; series by hdcal.
    """

    name: ClassVar[str] = "large_deflection"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("curve down",)
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "none"
    acts_at_once: ClassVar[bool] = True

    curvature: Float[Array, ""] | float = parameter(
        "1/mm",
        "one over the radius of the gear's neutral line",
        typical=0.025,
        null=0.0,
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the loss of stiffness added."""
        bent = self.curvature * rows.deformation
        loss = bent * (_FIRST + _SECOND * bent)
        return signal + rows.stiffness * rows.deformation * loss
