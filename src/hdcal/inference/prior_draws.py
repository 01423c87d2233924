"""Draws of each parameter from its prior."""

from collections.abc import Mapping
from functools import partial

import jax
import numpy as np

from hdcal.data.priors import Prior
from hdcal.inference.distributions import distribution
from hdcal.inference.problem import without_texts
from hdcal.inference.values import POSITIVE

_PRIOR_DRAWS = 2000


def draw_priors(priors: Mapping[str, Prior], key) -> dict[str, np.ndarray]:
    """Return draws of each parameter from its prior, (draw,) each."""
    found = _draws(tuple(without_texts(priors).values()), key, names=tuple(priors))
    return {
        name: np.asarray(values) for name, values in zip(priors, found, strict=True)
    }


@partial(jax.jit, static_argnames=("names",))
def _draws(priors: tuple[Prior, ...], key, *, names: tuple[str, ...]):
    keys = jax.random.split(key, len(names))
    return [
        distribution(prior, positive=name in POSITIVE).sample(key, (_PRIOR_DRAWS,))
        for key, name, prior in zip(keys, names, priors, strict=True)
    ]
