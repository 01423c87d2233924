"""From a prior table to NumPyro and SciPy distributions."""

import math
from functools import cache
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import scipy

from hdcal.data.priors import Prior

if TYPE_CHECKING:
    import numpyro.distributions as dist


def distribution(prior: Prior, *, positive: bool = False) -> "dist.Distribution":
    """Return the distribution of a prior that is not fixed.

    Args:
        prior: family and numbers.
        positive: cut a normal prior at zero (a modulus cannot be negative).
    """
    # Late: what was traced before needs none.
    import numpyro.distributions as dist

    numbers = prior.numbers
    match prior.family:
        case "normal" if positive:
            return dist.TruncatedNormal(numbers[0], numbers[1], low=0.0)
        case "normal":
            return dist.Normal(numbers[0], numbers[1])
        case "lognormal":
            return dist.LogNormal(jnp.log(numbers[0]), numbers[1])
        case "half_normal":
            return dist.HalfNormal(numbers[0])
        case "uniform":
            return dist.Uniform(numbers[0], numbers[1])
        case "beta":
            return dist.Beta(numbers[0], numbers[1])
    raise ValueError(f"no distribution for the prior family {prior.family!r}")


def frozen(prior: Prior) -> Any:
    """Return the prior as a SciPy distribution: cdf, quantiles and moments."""
    return _law(prior.family, tuple(float(number) for number in prior.numbers))


# SciPy writes a docstring for each frozen law, which costs more than its use.
@cache
def _law(family: str, numbers: tuple[float, ...]) -> Any:
    match family:
        case "normal":
            return scipy.stats.norm(*numbers)
        case "lognormal":
            return scipy.stats.lognorm(numbers[1], scale=numbers[0])
        case "half_normal":
            return scipy.stats.halfnorm(scale=numbers[0])
        case "uniform":
            return scipy.stats.uniform(numbers[0], numbers[1] - numbers[0])
        case "beta":
            return scipy.stats.beta(*numbers)
    raise ValueError(f"no distribution for the prior family {family!r}")


def bounds(prior: Prior) -> tuple[float, float]:
    """Return the ends of the prior's support."""
    match prior.family:
        case "normal":
            return -math.inf, math.inf
        case "lognormal" | "half_normal":
            return 0.0, math.inf
        case "uniform":
            return float(prior.numbers[0]), float(prior.numbers[1])
        case "beta":
            return 0.0, 1.0
    raise ValueError(f"no distribution for the prior family {prior.family!r}")


def moments(prior: Prior) -> tuple[float, float]:
    """Return mean and sd of a prior, in its own unit."""
    first, *others = (float(number) for number in prior.numbers)
    second = others[0] if others else 0.0
    match prior.family:
        case "fixed" | "normal":
            return first, second
        case "lognormal":
            mean = first * math.exp(0.5 * second**2)
            return mean, mean * math.sqrt(math.expm1(second**2))
        case "half_normal":
            return first * math.sqrt(2.0 / math.pi), first * math.sqrt(
                1.0 - 2.0 / math.pi
            )
        case "uniform":
            return 0.5 * (first + second), (second - first) / math.sqrt(12.0)
        case "beta":
            both = first + second
            return first / both, math.sqrt(first * second / (both + 1.0)) / both
    raise ValueError(f"no distribution for the prior family {prior.family!r}")
