"""A measuring or lead screw whose thread wobbles once per turn."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Rows, Stage, parameter


class ScrewError(Effect):
    """ω → ω + A sin(2π ω/p + φ), written as a sin(2π ω/p) + b cos(2π ω/p).

    Sine and cosine enter linearly, and at no error no phase is left undefined:
    A² = a² + b², tan φ = b/a.

    Source: A. H. Slocum, Precision Machine Design (1992), on lead-screw errors.
    """

    name: ClassVar[str] = "screw_error"
    stage: ClassVar[Stage] = "deformation"
    groups: ClassVar[tuple[str, ...]] = ("screw",)
    # The phase belongs to the screw, whichever way the gear is loaded.
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "none"
    period: ClassVar[str] = "pitch"

    sine: Float[Array, ""] | float = parameter(
        "mm", "sine part of the error over a turn", typical=0.003, null=0.0
    )
    cosine: Float[Array, ""] | float = parameter(
        "mm", "cosine part of the error over a turn", typical=-0.002, null=0.0
    )
    pitch: Float[Array, ""] | float = parameter(
        "mm", "radial travel per turn of the screw", typical=0.5
    )

    def apply(self, signal: Float[Array, " n"], rows: Rows) -> Float[Array, " n"]:
        """Return the deformation with the error of the screw added."""
        turn = 2.0 * jnp.pi * signal / self.pitch
        return signal + self.sine * jnp.sin(turn) + self.cosine * jnp.cos(turn)
