"""Prior families as NumPyro distributions and as frozen SciPy distributions."""

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from hdcal.data.prior import Prior

if TYPE_CHECKING:
    import numpyro.distributions as dist

# Parameters that cannot be negative: a normal prior of one is truncated at zero.
POSITIVE = frozenset({"E0", "sigma", "mass", "damping_ratio", "deformation_sigma"})


def distribution(prior: Prior, name: str = "") -> "dist.Distribution":
    """Return the NumPyro distribution of a prior; `ValueError` if it is fixed."""
    import numpyro.distributions as dist

    first, second = (*prior.numbers, math.nan)[:2]
    match prior.family:
        case "normal" if name in POSITIVE:
            return dist.TruncatedNormal(first, second, low=0.0)
        case "normal":
            return dist.Normal(first, second)
        case "lognormal":
            return dist.LogNormal(jnp.log(first), second)
        case "half_normal":
            return dist.HalfNormal(first)
        case "uniform":
            return dist.Uniform(first, second)
        case "beta":
            return dist.Beta(first, second)
    raise ValueError(f"no distribution for the prior family {prior.family!r}")


def frozen(prior: Prior, name: str = "") -> Any:
    """Return the SciPy distribution of a prior; `ValueError` if it is fixed."""
    return _frozen(prior.family, (*map(float, prior.numbers),), name in POSITIVE)[0]


def moments(prior: Prior, name: str = "") -> tuple[float, float]:
    """Return mean and sd of the prior of a parameter; the sd of a fixed one is 0."""
    if prior.family == "fixed":
        return float(prior.numbers[0]), 0.0
    return _frozen(prior.family, (*map(float, prior.numbers),), name in POSITIVE)[1]


# A SciPy distribution takes longer to make than to evaluate.
@lru_cache(maxsize=1024)
def _frozen(
    family: str, numbers: tuple[float, ...], positive: bool
) -> tuple[Any, tuple[float, float]]:
    """Return a SciPy distribution with its mean and sd."""
    from scipy import stats

    first, second = (*numbers, math.nan)[:2]
    match family:
        case "normal" if positive:
            found = stats.truncnorm(-first / second, math.inf, first, second)
        case "normal":
            found = stats.norm(first, second)
        case "lognormal":
            found = stats.lognorm(second, scale=first)
        case "half_normal":
            found = stats.halfnorm(scale=first)
        case "uniform":
            found = stats.uniform(first, second - first)
        case "beta":
            found = stats.beta(first, second)
        case _:
            raise ValueError(f"no distribution for the prior family {family!r}")
    return found, (float(found.mean()), float(found.std()))


def quantiles(prior: Prior, count: int, name: str = "") -> np.ndarray:
    """Return quantiles of a prior that stand for it with equal weights."""
    if prior.family == "fixed":
        return np.array([float(prior.numbers[0])])
    return np.asarray(frozen(prior, name).ppf((np.arange(count) + 0.5) / count))


def sample_prior(
    prior: Prior, name: str, rng: np.random.Generator, count: int
) -> np.ndarray:
    """Return draws of a parameter from its prior, possibly fixed, shape (count,)."""
    if prior.family == "fixed":
        return np.full(count, float(prior.numbers[0]))
    return np.asarray(frozen(prior, name).ppf(rng.random(count)))
