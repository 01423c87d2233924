"""Differences between loading and unloading: yield, friction and hysteresis."""

import jax.numpy as jnp
import numpy as np

from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.history import play, stop_cells
from hdcal.physics.theory import Scalar


class PlasticYield(Effect, stage="force", family="loop", needs=("unloading",)):
    """F → F − s k ω_p, ω_p the play of ω with half-width ω_y (Prandtl's element).

    Beyond the yield deformation ω_y the stiffness is (1 − s) k, on unloading it is k
    again: what remains without force is the permanent set. It belongs to the
    specimen and outlasts the run. A spring in series with dry friction is the same
    within one mounting.

    Source: L. Prandtl, ZAMM 8 (1928); parallel elastic branch after G. Masing (1926).
    """

    softening: Scalar = parameter(
        "1", "share of the stiffness lost beyond yield", typical=0.2, null=0.0
    )
    yield_deformation: Scalar = parameter(
        "mm", "radial deformation at which a new gear yields", typical=0.35
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        # Specimen after specimen, each from its first row, whatever the run.
        half_width = jnp.reshape(self.yield_deformation, (1,))
        (plastic,) = play(rows.deformation, rows.records.specimen, half_width)
        return signal - self.softening * rows.stiffness * plastic


class CoulombFriction(
    Effect, stage="force", family="loop", needs=("unloading",), instantaneous=True
):
    """F → F + F_c s, with s the sign of the last movement; a hold keeps it.

    Dry friction of guides and contacts: a force opposing the motion.
    """

    force: Scalar = parameter(
        "N", "friction force, half the width of the loop", typical=2.0, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal + self.force * rows.records.sense


class LoadFriction(
    Effect, stage="force", family="loop", needs=("unloading",), instantaneous=True
):
    """F → F + μ |k ω| s, with s the sign of the last movement; a hold keeps it.

    Dry friction of contacts that the load itself presses together.
    """

    share: Scalar = parameter(
        "1", "friction per elastic force, half the loop's width", typical=0.02, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        load = jnp.abs(rows.stiffness * rows.deformation)
        return signal + self.share * load * rows.records.sense


# Where the cells slip, in reaches. Evenly spread, so the loop bends gradually.
_SPREAD = np.array([0.25, 0.5, 0.75, 1.0])


class Hysteresis(Effect, stage="force", family="loop", needs=("unloading",)):
    """Rate-independent loop of stop cells in parallel: F → F + F_h mean(z_j).

    Microslip of material and joints that reverses with the movement. A cell sticks and
    then slips, z_j ← clip(z_j + Δω/ω_j, −1, 1), with the ω_j spread evenly up to
    `reach`. Every run starts from rest at ω = 0.

    Source: Iwan, J. Appl. Mech. 33 (1966), distributed elasto-slip elements.
    """

    force: Scalar = parameter(
        "N", "force when all cells slip, half the loop's width", typical=4.0, null=0.0
    )
    reach: Scalar = parameter(
        "mm", "deformation from rest at which all cells slip", typical=0.1
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        cells = stop_cells(rows.deformation, rows.records.run, self.reach * _SPREAD)
        return signal + self.force * jnp.mean(cells, axis=0)
