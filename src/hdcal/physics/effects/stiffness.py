"""Stiffness of the gear that depends on deformation, angle or load cycles."""

import jax.numpy as jnp

from hdcal.physics.effect import Effect, PerRow, Rows, parameter
from hdcal.physics.history import load_cycle
from hdcal.physics.theory import Scalar

# Rounding radius of |ω| at zero [mm], far below any reading.
_CORNER = 1e-4


class ProgressiveStiffening(
    Effect, stage="force", family="curve up", instantaneous=True
):
    """F → F + k ω · a |ω|: tangent stiffness k (1 + 2 a |ω|).

    The contact line moves and teeth bed in.
    """

    slope: Scalar = parameter(
        "1/mm", "relative gain of secant stiffness per mm", typical=0.4, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        depth = jnp.sqrt(rows.deformation**2 + _CORNER**2) - _CORNER
        return signal + rows.stiffness * rows.deformation * self.slope * depth


# Series of the inextensible elastic ring under two opposed loads, in ω/R.
_FIRST, _SECOND = -1.543, 3.35


class LargeDeflection(Effect, stage="force", family="curve down", instantaneous=True):
    """F → F + k ω (−1.543 κω + 3.35 (κω)²), κ = 1/R of the gear; κ = 0: straight.

    Compression (ω > 0) softens, tension stiffens: the loads' lever arm is half the
    width of the ring, which grows as the ring is flattened.

    Source: R. Frisch-Fay, Flexible Bars (1962), on thin rings; series by hdcal.
    """

    curvature: Scalar = parameter(
        "1/mm", "one over the radius of the neutral line", typical=0.025, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        bent = self.curvature * rows.deformation
        loss = bent * (_FIRST + _SECOND * bent)
        return signal + rows.stiffness * rows.deformation * loss


def _share(meaning: str, typical: float) -> Scalar:
    return parameter("1", meaning, typical=typical, null=0.0)


class Ovality(Effect, stage="force", family="angle", needs=("angle",)):
    """F → F + k ω (c₁ cos θ + s₁ sin θ + c₂ cos 2θ + s₂ sin 2θ).

    The gear is stiffer on one diameter than on another: runout and ovality. The same as
    k (1 + e₁ cos(θ − φ₁) + e₂ cos 2(θ − φ₂)), linear in its amplitudes.

    Source: ISO 1101 (circularity); first harmonics of a wall of uneven thickness.
    """

    cos_1: Scalar = _share("stiffness, once per turn, cosine", 0.015)
    sin_1: Scalar = _share("stiffness, once per turn, sine", -0.01)
    cos_2: Scalar = _share("stiffness, twice per turn, cosine", 0.01)
    sin_2: Scalar = _share("stiffness, twice per turn, sine", 0.015)

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        angle = rows.records.angle
        gain = self.cos_1 * jnp.cos(angle) + self.sin_1 * jnp.sin(angle)
        gain += self.cos_2 * jnp.cos(2.0 * angle) + self.sin_2 * jnp.sin(2.0 * angle)
        return signal + rows.stiffness * rows.deformation * gain


class StiffnessFatigue(
    Effect, stage="force", family="mounting or gear", needs=("cycles",)
):
    """F → F − k ω b log₁₀ N, with N the load cycle of the specimen, from 1.

    Stiffness lost to repeated loading.

    Source: Dowling, Mechanical Behavior of Materials (cyclic softening).
    """

    loss: Scalar = parameter(
        "1", "relative loss per decade of load cycles", typical=0.015, null=0.0
    )

    def apply(self, signal: PerRow, rows: Rows) -> PerRow:
        records = rows.records
        cycle = load_cycle(records.sense, records.run, records.specimen)
        return signal - rows.stiffness * rows.deformation * self.loss * jnp.log10(cycle)
