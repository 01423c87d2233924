"""Contacts in series with the gear or parallel to it: play, bedding, stops."""

import jax.numpy as jnp

from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.theory import Scalar

# Far below any clearance [mm]; keeps the gradient finite at rest.
_NEGLIGIBLE = 1e-6


class SeatingSlack(Effect, stage="deformation", family="curve up", instantaneous=True):
    """Dead zone of the deformation, ω → ω − ω_c clip(ω/ω_c, −1, 1), smoothed.

    Play is taken up before the gear carries load. For ω > 0 this is max(0, ω − ω_c).
    The clip is x (1 + x⁸)^(−1/8): smooth, and a third of a clearance away from the
    corner within 1.2 % of a clearance of it.
    """

    clearance: Scalar = parameter(
        "mm", "radial play taken up before contact", typical=0.02, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        eighth = signal**8 + self.clearance**8 + _NEGLIGIBLE**8
        return signal - self.clearance * signal / eighth**0.125


# Rounding radius of |ω| at zero [mm], far below any reading.
_CORNER = 1e-4


class ContactBedding(
    Effect, stage="deformation", family="curve up", instantaneous=True
):
    """ω = ω_g + δ(k ω_g), δ(F) = c F/(F + P): half closed at F = P.

    Contacts in series with the gear close under load, soft first, then hard. Solved for
    ω_g, the deformation of the gear; tension mirrors compression.

    Source: Bandis, Lumsden and Barton (1983), hyperbolic closure of a joint.
    """

    closure: Scalar = parameter(
        "mm", "radial closure of the contacts when fully bedded", typical=0.03, null=0.0
    )
    load: Scalar = parameter(
        "N", "force at which half of the closure is used up", typical=20.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        depth = jnp.sqrt(signal**2 + _CORNER**2)
        # In ω_g a parabola, k ω_g² − (k (|ω| − c) − P) ω_g − |ω| P = 0; its positive
        # root in the form that needs no division by k.
        left = rows.stiffness * (depth - self.closure) - self.load
        root = jnp.sqrt(left**2 + 4.0 * rows.stiffness * depth * self.load)
        return signal * 2.0 * self.load / (root - left)


# The corner is rounded over this share of the onset, and no less than [mm].
_ROUNDED, _LEAST = 0.02, 1e-4


class ContactOnset(Effect, stage="force", family="curve up", instantaneous=True):
    """F → F + k₂ max(0, |ω| − ω_c) sign ω, k₂ = r k, with a rounded corner.

    A second contact closes at some deformation and stiffens the gear.
    """

    ratio: Scalar = parameter(
        "1", "stiffness of the second contact over the gear's", typical=0.5, null=0.0
    )
    onset: Scalar = parameter(
        "mm", "deformation at which the contact closes", typical=0.25
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        width = jnp.sqrt((_ROUNDED * self.onset) ** 2 + _LEAST**2)

        def beyond(depth):
            return 0.5 * (depth + jnp.sqrt(depth**2 + width**2))

        # Two opposed ramps: odd, and smooth through zero.
        travel = beyond(rows.deformation - self.onset)
        travel = travel - beyond(-rows.deformation - self.onset)
        return signal + self.ratio * rows.stiffness * travel
