"""Zero of the amplifier walking off since its reset."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class AmplifierDrift(Effect):
    """F → F + r t, with t since the reset of the run; either sign.

    Source: Gautschi, Piezoelectric Sensorics (drift of charge amplifiers).
    """

    name: ClassVar[str] = "amplifier_drift"
    stage: ClassVar[Stage] = "sensor"
    groups: ClassVar[tuple[str, ...]] = ("rate or time",)
    needs: ClassVar[frozenset[str]] = frozenset({"time"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"

    rate: Float[Array, ""] | float = parameter(
        "N/s", "shift of the zero per second", typical=0.02, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the zero shifted."""
        return signal + self.rate * rows.records.time
