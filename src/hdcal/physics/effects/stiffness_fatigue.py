"""Stiffness lost to repeated loading."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter
from hdcal.physics.history import load_cycle


class StiffnessFatigue(Effect):
    """F → F − k ω b log₁₀ N, with N the load cycle of the specimen, from 1.

    Source: Dowling, Mechanical Behavior of Materials (cyclic softening).
    """

    name: ClassVar[str] = "stiffness_fatigue"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("mounting or gear",)
    needs: ClassVar[frozenset[str]] = frozenset({"cycles"})

    loss: Float[Array, ""] | float = parameter(
        "1",
        "relative loss of stiffness per decade of load cycles",
        typical=0.015,
        null=0.0,
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force less what was lost."""
        records = rows.records
        cycle = load_cycle(records.sense, records.run, records.specimen)
        return signal - rows.stiffness * rows.deformation * self.loss * jnp.log10(cycle)
