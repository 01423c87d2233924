"""Prior families as NumPyro distributions and as frozen SciPy distributions."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
from scipy import stats

from hdcal.data.prior import Prior

# Parameters that cannot be negative: a normal prior of one is truncated at zero.
POSITIVE = frozenset({"E0", "sigma", "mass", "damping_ratio", "deformation_sigma"})


class _Family(NamedTuple):
    """Both forms of a family, as functions of the prior's numbers."""

    numpyro: Callable[..., dist.Distribution]
    scipy: Callable[..., Any]


_FAMILIES = {
    "normal": _Family(dist.Normal, stats.norm),
    "lognormal": _Family(
        lambda median, log_sd: dist.LogNormal(jnp.log(median), log_sd),
        lambda median, log_sd: stats.lognorm(log_sd, scale=median),
    ),
    "half_normal": _Family(dist.HalfNormal, lambda sd: stats.halfnorm(scale=sd)),
    "uniform": _Family(dist.Uniform, lambda low, high: stats.uniform(low, high - low)),
    "beta": _Family(dist.Beta, stats.beta),
}
_POSITIVE_NORMAL = _Family(
    lambda mean, sd: dist.TruncatedNormal(mean, sd, low=0.0),
    lambda mean, sd: stats.truncnorm(-mean / sd, float("inf"), mean, sd),
)


def _family(prior: Prior, name: str) -> _Family:
    if prior.family == "normal" and name in POSITIVE:
        return _POSITIVE_NORMAL
    if prior.family not in _FAMILIES:
        raise ValueError(f"no distribution for the prior family {prior.family!r}")
    return _FAMILIES[prior.family]


def distribution(prior: Prior, name: str = "") -> dist.Distribution:
    """Return the NumPyro distribution of a prior that is not fixed.

    Args:
        prior: family and numbers.
        name: of the parameter.
    """
    return _family(prior, name).numpyro(*prior.numbers)


def frozen(prior: Prior, name: str = "") -> Any:
    """Return the SciPy distribution of a prior that is not fixed.

    Args:
        prior: family and numbers.
        name: of the parameter.
    """
    return _family(prior, name).scipy(*map(float, prior.numbers))


def moments(prior: Prior, name: str = "") -> tuple[float, float]:
    """Return mean and sd of a prior, in its own unit.

    Args:
        prior: family and numbers; the sd of a fixed one is 0.
        name: of the parameter.
    """
    if prior.family == "fixed":
        return float(prior.numbers[0]), 0.0
    law: Any = frozen(prior, name)
    return float(law.mean()), float(law.std())


def sample_prior(
    prior: Prior, name: str, rng: np.random.Generator, count: int
) -> np.ndarray:
    """Return draws of a parameter from its prior, shape (count,).

    Args:
        prior: family and numbers, possibly fixed.
        name: of the parameter.
        rng: source of randomness.
        count: number of draws.
    """
    if prior.family == "fixed":
        return np.full(count, float(prior.numbers[0]))
    return np.asarray(frozen(prior, name).ppf(rng.random(count)))


def effective_priors(
    priors: Mapping[str, Prior], values: Mapping, mountings: int
) -> dict[str, Prior]:
    """Return the priors, that of the force zero given how mountings differ.

    A certificate states the zero of the gauge itself. To it the mean of n tested
    mountings adds N(0, τ²/n), τ their sd: the parameter is the zero of that mean.

    Args:
        priors: by site name.
        values: parameters of one draw, or medians of them.
        mountings: n; 0 where no certificate states the zero, or none differ.
    """
    if not mountings:
        return dict(priors)
    zero = priors["force_offset"]
    middle, gauge = zero.numbers
    of_mean = jnp.asarray(values["run_offset_sd"]) / jnp.sqrt(mountings)
    both = Prior("normal", (middle, jnp.hypot(gauge, of_mean)), zero.unit, zero.source)
    return {**priors, "force_offset": both}
