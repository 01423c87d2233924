"""An effect of one's own that does not bear padded rows."""

import jax.numpy as jnp

from hdcal.physics.effect import Effect, parameter


class Centred(Effect, stage="force", groups=("zero over temperature",)):
    """A force about the mean deformation: it looks at rows to come."""

    size: float = parameter("N/mm", "force over the mean", typical=1.0, null=0.0)

    def apply(self, signal, rows):
        """Return the force and its share."""
        return signal + self.size * (rows.deformation - jnp.mean(rows.deformation))
