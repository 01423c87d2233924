"""Load that the gear itself gives up while its deformation is held."""

from typing import ClassVar

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter
from hdcal.physics.history import fading


class Relaxation(Effect):
    """One Prony arm: F → F − s ∫ (1 − e^(−(t−t')/τ)) d(k ω)(t').

    k ω is taken as linear in time between rows, for which the step is exact. Every
    run starts relaxed at the reset, as a gear that has rested for many τ.

    Source: Ferry, Viscoelastic Properties of Polymers (standard linear solid).
    """

    name: ClassVar[str] = "relaxation"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("rate or time",)
    needs: ClassVar[frozenset[str]] = frozenset({"time", "holds or rates"})

    share: Float[Array, ""] | float = parameter(
        "1", "share of the load that relaxes in the end", typical=0.03, null=0.0
    )
    time_constant: Float[Array, ""] | float = parameter(
        "s", "time in which that share falls to 37 %", typical=30.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force less what has relaxed."""
        load, records = rows.stiffness * rows.deformation, rows.records
        left = fading(load, records.time, records.run, 1.0 / self.time_constant)
        return signal - self.share * (load - left)
