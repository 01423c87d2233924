"""Readings that went wrong: a few rows carry a much larger error."""

from typing import ClassVar, Literal

import jax.numpy as jnp
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.physics.effect import Effect, Noise, Rows, Stage, parameter

# A fraction of exactly zero has no logarithm. This one is nothing in double precision
# for readings up to 26 sds out, and the slope at zero stays right.
_NONE = 1e-150


class Outliers(Effect):
    """Contaminated normal: with probability π the noise sd is c times larger.

    Source: Tukey's contamination model (1960).
    """

    name: ClassVar[str] = "outliers"
    stage: ClassVar[Stage] = "noise"
    groups: ClassVar[tuple[str, ...]] = ("noise",)
    symmetry: ClassVar[Literal["odd", "even", "none"]] = "even"
    mixture: ClassVar[bool] = True

    fraction: Float[Array, ""] | float = parameter(
        "1", "share of wild readings", typical=0.07, null=0.0
    )
    ratio: Float[Array, ""] | float = parameter(
        "1", "noise sd of a wild reading over an ordinary one", typical=5.0
    )

    def apply(self, signal: Noise, rows: Rows) -> Noise:
        """Return the mixture with a wide copy of every component."""
        wild = jnp.log(self.fraction + _NONE)
        tame = jnp.log1p(-self.fraction)
        return Noise(
            jnp.concatenate([signal.log_weight + tame, signal.log_weight + wild]),
            jnp.concatenate([signal.sd, signal.sd * self.ratio]),
        )
