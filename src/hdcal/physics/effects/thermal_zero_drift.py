"""Zero of the force sensor moving with temperature."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class ThermalZeroDrift(Effect):
    """F → F + z (T − T_ref).

    Source: handbook (temperature coefficient of zero in force-sensor data sheets).
    """

    name: ClassVar[str] = "thermal_zero_drift"
    stage: ClassVar[Stage] = "sensor"
    groups: ClassVar[tuple[str, ...]] = ("zero over temperature",)
    needs: ClassVar[frozenset[str]] = frozenset({"temperature"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"

    slope: Float[Array, ""] | float = parameter(
        "N/K", "shift of the zero per kelvin", typical=0.1, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the zero shifted."""
        return signal + self.slope * rows.temperature_rise
