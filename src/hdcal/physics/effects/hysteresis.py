"""Loops of material and joints: microslip that reverses with the movement."""

from typing import ClassVar, Literal

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter
from hdcal.physics.history import stop_cells

# Where the cells slip, in reaches. Evenly spread, so the loop bends gradually.
_SPREAD = np.array([0.25, 0.5, 0.75, 1.0])


class Hysteresis(Effect):
    """Rate-independent loop of stop cells in parallel: F → F + F_h mean(z_j).

    A cell sticks and then slips, z_j ← clip(z_j + Δω/ω_j, −1, 1), with the ω_j
    spread evenly up to `reach`. Every run starts from rest at ω = 0.

    Source: Iwan, J. Appl. Mech. 33 (1966), distributed elasto-slip elements.
    """

    name: ClassVar[str] = "hysteresis"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("loop",)
    needs: ClassVar[frozenset[str]] = frozenset({"unloading"})
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "none"

    force: Float[Array, ""] | float = parameter(
        "N",
        "force of all cells slipping, half the width of the loop",
        typical=4.0,
        null=0.0,
    )
    reach: Float[Array, ""] | float = parameter(
        "mm", "deformation from rest until every cell slips", typical=0.1
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the cells' share added."""
        cells = stop_cells(rows.deformation, rows.records.run, self.reach * _SPREAD)
        return signal + self.force * jnp.mean(cells, axis=0)
