"""Errors of the rig, the displacement gauge and the force sensor."""

import jax.numpy as jnp

from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.theory import Scalar


class RigCompliance(
    Effect,
    stage="deformation",
    family="rig",
    needs=("readings of the rig alone",),
    instantaneous=True,
):
    """ω → ω/(1 + c k): springs in series, 1/k_read = 1/k + c.

    The stretch of the rig is read as deformation of the gear. Readings on the gear
    alone are those of a softer gear, so data never test this effect.
    """

    compliance: Scalar = parameter(
        "mm/N", "stretch of rig and fixture per force", typical=2.5e-4, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal / (1.0 + self.compliance * rows.stiffness)


class DisplacementNonlinearity(Effect, stage="deformation", family="curve up"):
    """ω → ω + e₁ ω².

    The characteristic of the displacement gauge is slightly curved. The parabola
    continues through zero, so the error has the same sign on either side.
    """

    curvature: Scalar = parameter(
        "1/mm", "relative error of the gauge per mm", typical=0.04, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        return signal * (1.0 + self.curvature * signal)


class ScrewError(Effect, stage="deformation", family="screw", period="pitch"):
    """ω → ω + A sin(2π ω/p + φ), written as a sin(2π ω/p) + b cos(2π ω/p).

    The thread of a measuring or lead screw wobbles once per turn; its phase does not
    depend on the sense of the load. Sine and cosine enter linearly, and the phase
    is defined at no error: A² = a² + b², tan φ = b/a.

    Source: A. H. Slocum, Precision Machine Design (1992), on lead-screw errors.
    """

    sine: Scalar = parameter(
        "mm", "sine part of the error over a turn", typical=0.003, null=0.0
    )
    cosine: Scalar = parameter(
        "mm", "cosine part of the error over a turn", typical=-0.002, null=0.0
    )
    pitch: Scalar = parameter("mm", "radial travel per turn of the screw", typical=0.5)

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        turn = 2.0 * jnp.pi * signal / self.pitch
        return signal + self.sine * jnp.sin(turn) + self.cosine * jnp.cos(turn)


# Below this x the series of tanh(√x)/√x, cut after x³, is exact in double precision.
_SMALL = 1e-3


class ForceSaturation(Effect, stage="sensor", family="curve down"):
    """F → F_s tanh(F/F_s) = F (1 − h F² + …), written in h = 1/(3 F_s²).

    A force sensor reads less and less of a large force. The loss of reading is h F² to
    first order, in proportion to h; in 1/F_s its derivative at zero would vanish.
    """

    curvature: Scalar = parameter(
        "1/N^2", "relative loss of reading per squared force", typical=8e-7, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        x = 3.0 * self.curvature * signal**2
        small = x < _SMALL
        root = jnp.sqrt(jnp.where(small, 1.0, x))
        series = 1.0 - x * (1 / 3 - x * (2 / 15 - x * (17 / 315 - x * (62 / 2835))))
        return signal * jnp.where(small, series, jnp.tanh(root) / root)
