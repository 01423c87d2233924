"""Changes with temperature beyond that of the modulus."""

from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.theory import Scalar


class ThermalExpansion(
    Effect, stage="deformation", family="zero over temperature", needs=("temperature",)
):
    """ω → ω + a (T − T_ref), radial.

    Frame and gear expand: the zero of the displacement gauge moves.
    """

    slope: Scalar = parameter(
        "mm/K", "radial deformation gained per kelvin", typical=1.1e-3, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.slope * rows.temperature_rise


class ThermalStiffness(
    Effect,
    stage="force",
    family="slope over temperature",
    needs=("temperature",),
    instantaneous=True,
):
    """F → F + k ω g (T − T_ref), beyond E(T).

    The stiffness changes with temperature by more than the modulus explains. Readings
    give the sum of g and −α only; the prior of α separates them.
    """

    slope: Scalar = parameter(
        "1/K", "relative gain of stiffness per kelvin", typical=3e-4, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        gain = self.slope * rows.temperature_rise
        return signal + rows.stiffness * rows.deformation * gain


class ThermalZeroDrift(
    Effect, stage="sensor", family="zero over temperature", needs=("temperature",)
):
    """F → F + z (T − T_ref).

    The zero of the force sensor moves with temperature.
    """

    slope: Scalar = parameter(
        "N/K", "shift of the zero per kelvin", typical=0.1, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.slope * rows.temperature_rise
