"""Every gear of a batch has a stiffness of its own."""

from typing import ClassVar

from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Rows, Stage, parameter
from hdcal.physics.scatter import Kind, Scatter


class SpecimenVariation(Scatter):
    """F → F (1 + d_i) of specimen i, with d_i ~ N(0, sd²).

    Source: Gelman et al., Bayesian Data Analysis (varying-slope model).
    """

    name: ClassVar[str] = "specimen_variation"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("mounting or gear",)
    needs: ClassVar[frozenset[str]] = frozenset({"specimens"})
    members: ClassVar[Kind] = "specimen"

    sd: Float[Array, ""] | float = parameter(
        "1",
        "relative spread of the stiffnesses of the specimens",
        typical=0.05,
        null=0.0,
    )

    def unit(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force itself: a deviation of one doubles it."""
        return signal
