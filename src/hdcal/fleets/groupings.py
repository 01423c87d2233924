"""Lots of gears, operators and rigs of mountings: groups that scatter about their mean.

How k groups lie about the mean of these k is told by k − 1 contrasts c ~ N(0, sd²).
They are sampled as what the data alone would say of them, drawn towards zero by the
scatter: c = w e + √(w v) u with w = sd²/(sd² + v), of an estimate e and its variance v.
Then u is nearly a standard normal whatever the scatter, and no funnel is left. The
density of u is taken off again, so that the law of c is exact whatever e and v are.

Source:
    Papaspiliopoulos, Roberts and Sköld, Statistical Science 22 (2007), partly centred.
"""

from collections.abc import Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
from jaxtyping import Float
from scipy.linalg import helmert

from hdcal.data.records import Array


class Grouping(eqx.Module):
    """Where groups seem to be, which shapes the sampler's coordinates only.

    Attributes:
        basis: orthonormal contrasts of the groups, [group, contrast].
        estimate: of each contrast.
        variance: of the estimate.
    """

    basis: Float[Array, "k c"]
    estimate: Float[Array, " c"]
    variance: Float[Array, " c"]

    @property
    def offsets(self) -> np.ndarray:
        """How far each group seems to lie from the mean of all, shape (k,)."""
        return np.asarray(self.basis @ self.estimate)


def grouping(means: np.ndarray, covariance: np.ndarray) -> Grouping:
    """Return groups from the mean of each, shape (k,), and their covariance."""
    basis = helmert(len(means)).T
    return Grouping(basis, basis.T @ means, np.diag(basis.T @ covariance @ basis))


def sample_offsets(kind: str, groups: Grouping, sd) -> dict:
    """Sample how far each group lies from the mean of all, as `kind`_1, ….

    Args:
        kind: what the groups are called.
        groups: where they seem to be.
        sd: their scatter.
    """
    weight = sd**2 / (sd**2 + groups.variance)
    scale = jnp.sqrt(weight * groups.variance)
    plain, places = dist.Normal(0.0, 1.0), range(1, len(groups.basis))
    u = jnp.stack([numpyro.sample(f"_{kind}_{place}", plain) for place in places])
    contrast = weight * groups.estimate + scale * u
    law = dist.Normal(0.0, sd).log_prob(contrast) + jnp.log(scale) - plain.log_prob(u)
    numpyro.factor(f"_{kind}_prior", jnp.sum(law))
    offsets = groups.basis @ contrast
    names = (f"{kind}_{place}" for place in range(1, len(offsets) + 1))
    return {
        name: numpyro.deterministic(name, offset)
        for name, offset in zip(names, offsets, strict=True)
    }


def group_offsets(values: Mapping, kind: str) -> Float[Array, "k ..."]:
    """Return how far each group lies from the mean of all.

    One of zero where none is told.

    Args:
        values: of one draw or of many.
        kind: what the groups are called.
    """
    names = [
        f"{kind}_{k}" for k in range(1, len(values) + 1) if f"{kind}_{k}" in values
    ]
    if not names:
        return jnp.zeros_like(next(iter(values.values())))[None]
    return jnp.stack([values[name] for name in names])
