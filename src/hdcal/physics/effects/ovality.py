"""A gear that is stiffer on one diameter than on another: runout and ovality."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


def _share(meaning: str, typical: float) -> Float[Array, ""] | float:
    return parameter("1", meaning, typical=typical, null=0.0)


class Ovality(Effect):
    """F → F + k ω (c₁ cos θ + s₁ sin θ + c₂ cos 2θ + s₂ sin 2θ).

    The same as k (1 + e₁ cos(θ − φ₁) + e₂ cos 2(θ − φ₂)), linear in its amplitudes.

    Source: ISO 1101 (circularity); first harmonics of a wall of uneven thickness.
    """

    name: ClassVar[str] = "ovality"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("angle",)
    needs: ClassVar[frozenset[str]] = frozenset({"angle"})

    cos_1: Float[Array, ""] | float = _share("stiffness, once per turn, cosine", 0.015)
    sin_1: Float[Array, ""] | float = _share("stiffness, once per turn, sine", -0.01)
    cos_2: Float[Array, ""] | float = _share("stiffness, twice per turn, cosine", 0.01)
    sin_2: Float[Array, ""] | float = _share("stiffness, twice per turn, sine", 0.015)

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the force with the stiffness of the loaded diameter."""
        angle = rows.records.angle
        gain = self.cos_1 * jnp.cos(angle) + self.sin_1 * jnp.sin(angle)
        gain += self.cos_2 * jnp.cos(2.0 * angle) + self.sin_2 * jnp.sin(2.0 * angle)
        return signal + rows.stiffness * rows.deformation * gain
