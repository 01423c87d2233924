"""Draws of each parameter from its prior."""

from collections.abc import Mapping

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.inference.density import (
    POSITIVE,
)
from hdcal.inference.distributions import distribution

_PRIOR_DRAWS = 2000


def draw_priors(priors: Mapping[str, Prior], key) -> dict[str, np.ndarray]:
    """Return draws of each parameter from its prior, (draw,) each."""
    keys = jax.random.split(key, len(priors))
    return {
        name: np.asarray(
            distribution(prior, positive=name in POSITIVE).sample(k, (_PRIOR_DRAWS,))
        )
        for k, (name, prior) in zip(keys, priors.items(), strict=True)
    }
