"""Frame and gear that expand: the displacement gauge's zero moves when warm."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class ThermalExpansion(Effect):
    """ω → ω + a (T − T_ref), radial.

    Source: handbook (thermal expansion of unequal lengths in a measuring loop).
    """

    name: ClassVar[str] = "thermal_expansion"
    stage: ClassVar[Stage] = "deformation"
    groups: ClassVar[tuple[str, ...]] = ("zero over temperature",)
    needs: ClassVar[frozenset[str]] = frozenset({"temperature"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"

    slope: Float[Array, ""] | float = parameter(
        "mm/K", "radial deformation gained per kelvin", typical=1.1e-3, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the deformation with the expansion added."""
        return signal + self.slope * rows.temperature_rise
