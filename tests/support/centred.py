"""An effect of one's own that does not bear padded rows."""

from typing import ClassVar

import jax.numpy as jnp

from hdcal.physics.effect import Effect, Stage, parameter


class Centred(Effect):
    """A force about the mean deformation: it looks at rows to come."""

    name: ClassVar[str] = "centred"
    stage: ClassVar[Stage] = "force"
    groups: ClassVar[tuple[str, ...]] = ("zero over temperature",)

    size: float = parameter("N/mm", "force over the mean", typical=1.0, null=0.0)

    def apply(self, signal, rows):
        """Return the force and its share."""
        return signal + self.size * (rows.deformation - jnp.mean(rows.deformation))
