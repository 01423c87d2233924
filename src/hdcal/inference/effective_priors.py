"""What is believed of each parameter given the scales of a draw."""

from collections.abc import Mapping

import jax.numpy as jnp

from hdcal.data.prior import Prior

_ZERO, _SCATTER = "force_offset", "run_offset_sd"


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
    zero = priors[_ZERO]
    middle, gauge = zero.numbers
    of_mean = jnp.asarray(values[_SCATTER]) / jnp.sqrt(mountings)
    both = Prior("normal", (middle, jnp.hypot(gauge, of_mean)), zero.unit, zero.source)
    return {**priors, _ZERO: both}
