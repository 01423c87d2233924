"""Dry friction of contacts that the load itself presses together."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class LoadFriction(Effect):
    """F → F + μ |k ω| s, with s the sign of the last movement; a hold keeps it.

    Source: handbook (Coulomb's law where the normal force goes with the load, as
    between the leaves of a spring).
    """

    name: ClassVar[str] = "load_friction"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("loop",)
    needs: ClassVar[frozenset[str]] = frozenset({"unloading"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "none"
    acts_at_once: ClassVar[bool] = True

    share: Float[Array, ""] | float = parameter(
        "1", "friction per elastic force, half the loop's width", typical=0.02, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with friction added."""
        load = jnp.abs(rows.stiffness * rows.deformation)
        return signal + self.share * load * rows.records.sense
