"""The prior of one parameter, as a typed pytree."""

import equinox as eqx
from jax import Array
from jaxtyping import Float

# family -> the numbers it needs, in the order of the distribution's arguments
FAMILIES: dict[str, tuple[str, ...]] = {
    "fixed": ("value",),
    "normal": ("mean", "sd"),
    "lognormal": ("median", "log_sd"),
    "half_normal": ("sd",),
    "uniform": ("low", "high"),
    "beta": ("a", "b"),
}


class Prior(eqx.Module):
    """The prior of one parameter, in code units.

    Attributes:
        family: a key of FAMILIES.
        numbers: the family's numbers in the order of FAMILIES[family].
        unit: unit of the parameter, for people.
        source: where the numbers come from.
    """

    family: str = eqx.field(static=True)
    numbers: tuple[Float[Array, ""] | float, ...]
    unit: str = eqx.field(static=True, default="")
    source: str = eqx.field(static=True, default="")


def scaled(prior: Prior, factor) -> Prior:
    """Return the prior of factor × parameter (factor > 0).

    Raises:
        ValueError: a beta prior has no scale.
    """
    if prior.family == "beta":
        raise ValueError("a beta prior cannot be rescaled")
    # A logarithm's spread does not change with the unit.
    numbers = tuple(
        number if size == "log_sd" else number * factor
        for size, number in zip(FAMILIES[prior.family], prior.numbers, strict=True)
    )
    return Prior(prior.family, numbers, prior.unit, prior.source)
