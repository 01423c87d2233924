"""Noise that grows with the force."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Noise, Rows, Stage, parameter


class HeteroscedasticNoise(Effect):
    """A part of the noise in proportion to the load: sd² → sd² + (s k ω)².

    Source: Carroll and Ruppert, Transformation and Weighting in Regression (1988).
    """

    name: ClassVar[str] = "heteroscedastic_noise"
    stage: ClassVar[Stage] = "noise"
    groups: ClassVar[tuple[str, ...]] = ("noise",)
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"

    share: Float[Array, ""] | float = parameter(
        "1", "noise per force, beside the noise at no force", typical=0.007, null=0.0
    )

    def apply(self, signal: Noise, rows: Rows) -> Noise:
        """Return the mixture with the variance of the load's noise added."""
        load = rows.stiffness * rows.deformation
        sd = jnp.sqrt(signal.sd**2 + (self.share * load) ** 2)
        return Noise(signal.log_weight, sd)
