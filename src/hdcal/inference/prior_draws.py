"""Draws of each parameter from its prior."""

from collections.abc import Mapping

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.inference.distributions import distribution
from hdcal.inference.problem import without_texts
from hdcal.inference.values import POSITIVE
from hdcal.programs import program

_PRIOR_DRAWS = 2000


def draw_priors(priors: Mapping[str, Prior], key) -> dict[str, np.ndarray]:
    """Return draws of each parameter from its prior, (draw,) each."""
    keys = jax.random.split(key, len(priors))
    return {
        name: np.asarray(_draw(prior, k, positive=name in POSITIVE))
        for k, (name, prior) in zip(keys, without_texts(priors).items(), strict=True)
    }


@program(static=("positive",))
def _draw(prior: Prior, key, *, positive: bool):
    return distribution(prior, positive=positive).sample(key, (_PRIOR_DRAWS,))
