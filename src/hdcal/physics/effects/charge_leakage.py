"""Charge that leaks from a piezo sensor's amplifier: readings sink towards zero."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter
from hdcal.physics.history import fading


class ChargeLeakage(Effect):
    """dF_m = dF − λ F_m dt, reset at the start of each run; λ = 1/τ.

    The force is taken as linear in time between rows, for which the step is exact:
    F_m ← F_m e^(−λΔt) + ΔF (1 − e^(−λΔt))/(λΔt). Before its first row a run has
    climbed from zero since the reset at t = 0.

    Source: charge-amplifier handbooks (discharge time constant τ = R C).
    """

    name: ClassVar[str] = "charge_leakage"
    stage: ClassVar[Stage] = "sensor"
    groups: ClassVar[tuple[str, ...]] = ("rate or time",)
    needs: ClassVar[frozenset[str]] = frozenset({"time"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "odd"

    rate: Float[Array, ""] | float = parameter(
        "1/s", "leak rate, one over the time constant", typical=1e-3, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force as the leaking amplifier shows it."""
        records = rows.records
        return fading(signal, records.time, records.run, self.rate)
