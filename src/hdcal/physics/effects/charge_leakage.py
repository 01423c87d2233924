"""Charge that leaks from a piezo sensor's amplifier: readings sink towards zero."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.physics.effect import Effect, Rows, Stage, parameter
from hdcal.physics.history import leaky_sum
from hdcal.rig.records import Array


class ChargeLeakage(Effect):
    """dF_m = dF − λ F_m dt, reset at the start of each run; λ = 1/τ.

    The force is taken as linear in time between rows, for which the step is exact:
    F_m ← F_m e^(−λΔt) + ΔF (1 − e^(−λΔt))/(λΔt). Before its first row a run has
    climbed from zero since the reset at t = 0.

    Source: charge-amplifier handbooks (discharge time constant τ = R C).
    """

    name: ClassVar[str] = "charge_leakage"
    stage: ClassVar[Stage] = "sensor"
    family: ClassVar[str] = "drift"
    needs: ClassVar[frozenset[str]] = frozenset({"time"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "odd"

    rate: Float[Array, ""] | float = parameter(
        "1/s", "leak rate, one over the time constant", typical=1e-3, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force as the leaking amplifier shows it."""
        # Run after run, also where the file takes turns between them.
        order = jnp.argsort(rows.records.run, stable=True)
        run, time, force = (
            jnp.asarray(column)[order]
            for column in (rows.records.run, rows.records.time, signal)
        )
        starts = jnp.diff(run, prepend=run[:1] - 1) != 0
        step = jnp.where(starts, time, jnp.diff(time, prepend=0.0))
        gain = jnp.where(starts, force, jnp.diff(force, prepend=0.0))
        loss = self.rate * step
        # (1 − e^−x)/x, with its series where the quotient would be 0/0.
        small = jnp.abs(loss) < 1e-6
        safe = jnp.where(small, 1.0, loss)
        kept = jnp.where(small, 1.0 - 0.5 * loss, -jnp.expm1(-safe) / safe)
        decay = jnp.where(starts, 0.0, jnp.exp(-loss))
        return jnp.zeros_like(force).at[order].set(leaky_sum(decay, gain * kept))
