"""Dry friction of guides and contacts: a force against the movement."""

from typing import ClassVar, Literal

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class CoulombFriction(Effect):
    """F → F + F_c s, with s the sign of the last movement; a hold keeps it.

    Source: handbook (Coulomb's law of dry friction).
    """

    name: ClassVar[str] = "coulomb_friction"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("loop",)
    needs: ClassVar[frozenset[str]] = frozenset({"unloading"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "none"
    acts_at_once: ClassVar[bool] = True

    force: Float[Array, ""] | float = parameter(
        "N", "friction force, half the width of the loop", typical=2.0, null=0.0
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with friction added."""
        return signal + self.force * rows.records.sense
