"""The interface of what is sampled: priors and a declared density."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import equinox as eqx
from jaxtyping import Float, Key

from hdcal.data.priors import Prior
from hdcal.data.records import Array

# Float scalars and arrays by site name.
Values = Mapping[str, Any]


class Sampled(eqx.Module):
    """A pytree of data and priors, by site in code units, that declares its density."""

    if TYPE_CHECKING:
        priors: dict[str, Prior]

    @property
    def sampled_weights(self) -> int:
        """Number of weights of a discrepancy that is not integrated out."""
        return 0

    @property
    def start(self) -> Mapping[str, Any]:
        """Known values of sites where a search of the mode starts."""
        return {}

    def declare(self) -> None:
        """Declare the joint density of parameters and data to NumPyro."""
        raise NotImplementedError(type(self).__name__)

    def log_likelihood(self, values: Values) -> Float[Array, ""]:
        """Return the log likelihood of the data, members integrated out if any."""
        raise NotImplementedError(type(self).__name__)

    def draw_members(self, values: Values, key: Key[Array, ""]) -> dict[str, Any]:
        """Draw the members that are integrated out, given the values of one draw."""
        return {}

    def priors_given(self, values: Mapping) -> dict[str, Prior]:
        """Return the prior of each parameter given the scales of one draw."""
        return self.priors


def model(problem: Sampled) -> None:
    """Declare the density of a problem, as NumPyro's handlers take it."""
    problem.declare()
