"""Stiffness that changes with temperature beyond what the modulus explains."""

from typing import ClassVar

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class ThermalStiffness(Effect):
    """F → F + k ω g (T − T_ref), beyond E(T).

    In the readings g and −α are one number; only the material's α tells them apart.

    Source: handbook (fits and seats that tighten or loosen with temperature).
    """

    name: ClassVar[str] = "thermal_stiffness"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("slope over temperature",)
    needs: ClassVar[frozenset[str]] = frozenset({"temperature"})
    acts_at_once: ClassVar[bool] = True

    slope: Float[Array, ""] | float = parameter(
        "1/K", "relative gain of stiffness per kelvin", typical=3e-4, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the gain added."""
        gain = self.slope * rows.temperature_rise
        return signal + rows.stiffness * rows.deformation * gain
