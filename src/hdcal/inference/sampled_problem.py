"""What samplers can take: a problem with priors and a declared density."""

from collections.abc import Mapping

import equinox as eqx

from hdcal.data.priors import Prior


class Sampled(eqx.Module):
    """A pytree of data and priors whose density `inference.model.model` declares.

    Another kind of problem subclasses this and registers its declaration with
    `model`; sampler, whitening and checks then serve it as they are.

    Attributes:
        priors: by site name, in code units.
    """

    priors: eqx.AbstractVar[dict[str, Prior]]

    @property
    def bent(self) -> bool:
        """Whether its density has bends, at which the gradient jumps."""
        return False

    def priors_given(self, values: Mapping) -> dict[str, Prior]:
        """Return the prior of each parameter given the scales of one draw.

        Args:
            values: parameters of the draw.
        """
        return self.priors
