"""A gear that yields: softer beyond some deformation, and bent for good."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter
from hdcal.physics.history import play


class PlasticYield(Effect):
    """F → F − s k ω_p, ω_p the play of ω with half-width ω_y (Prandtl's element).

    Beyond ω_y the stiffness is (1 − s) k, on the way back it is k again: what is left
    at no force is the permanent set. The set belongs to the specimen and outlives the
    run. A spring in series with dry friction is the same within one mounting.

    Source: L. Prandtl, ZAMM 8 (1928); parallel elastic branch after G. Masing (1926).
    """

    name: ClassVar[str] = "plastic_yield"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("loop",)
    needs: ClassVar[frozenset[str]] = frozenset({"unloading"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "odd"
    twin: ClassVar[str] = "a joint that sticks before it slips"

    softening: Float[Array, ""] | float = parameter(
        "1", "share of the stiffness lost beyond yield", typical=0.2, null=0.0
    )
    yield_deformation: Float[Array, ""] | float = parameter(
        "mm", "radial deformation at which a new gear yields", typical=0.35
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force less what the plastic part no longer bears."""
        # Specimen after specimen, each from its first row, whatever the run.
        order = jnp.argsort(rows.records.specimen, stable=True)
        specimen = jnp.asarray(rows.records.specimen)[order]
        starts = jnp.diff(specimen, prepend=specimen[:1] - 1) != 0
        deformation = jnp.asarray(rows.deformation)[order]
        plastic = play(deformation, self.yield_deformation, starts)
        plastic = jnp.zeros_like(signal).at[order].set(plastic)
        return signal - self.softening * rows.stiffness * plastic
