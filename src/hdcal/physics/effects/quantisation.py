"""Readings that come in steps of the display."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Noise, Rows, Stage, parameter


class Quantisation(Effect):
    """Rounding to a grid of step q seen as noise: sd² → sd² + q²/12.

    Source: Sheppard, Proc. London Math. Soc. 29 (1898), correction of the variance.
    """

    name: ClassVar[str] = "quantisation"
    stage: ClassVar[Stage] = "noise"
    groups: ClassVar[tuple[str, ...]] = ("noise",)
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"

    step: Float[Array, ""] | float = parameter(
        "N", "step of the readings", typical=0.98, null=0.0
    )

    def apply(self, signal: Noise, rows: Rows) -> Noise:
        """Return the mixture with the variance of the rounding added."""
        sd = jnp.sqrt(signal.sd**2 + self.step**2 / 12.0)
        return Noise(signal.log_weight, sd)
