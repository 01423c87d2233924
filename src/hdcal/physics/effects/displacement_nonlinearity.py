"""A displacement gauge whose characteristic is slightly curved."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class DisplacementNonlinearity(Effect):
    """ω → ω + e₁ ω².

    A gauge knows no tension: its parabola goes on through zero, so the error keeps
    its sign on either side.

    Source: handbook (linearity error in the data sheet of a displacement gauge).
    """

    name: ClassVar[str] = "displacement_nonlinearity"
    stage: ClassVar[Stage] = "deformation"
    groups: ClassVar[tuple[str, ...]] = ("curve up", "curve down")
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"

    curvature: Float[Array, ""] | float = parameter(
        "1/mm", "relative error of the gauge per mm", typical=0.04, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the deformation as a straight gauge would have read it."""
        return signal * (1.0 + self.curvature * signal)
