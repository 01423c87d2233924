"""Lots of gears, rigs and operators of mountings: groups about the mean of all.

How k groups lie about the mean of these k is given by k − 1 contrasts c ~ N(0, sd²).
They are sampled about their estimate from the data alone, shrunk towards zero by the
scatter: c = w e + √(w v) u with w = sd²/(sd² + v), of an estimate e and its variance v.
Then u is nearly standard normal whatever the scatter, and no funnel is left. The
density of u is divided out, so that the density of c is exact whatever e and v are.

Source:
    Papaspiliopoulos, Roberts and Sköld, Statistical Science 22 (2007), partial
    centring.
"""

from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
import scipy
from jaxtyping import Float
from scipy.linalg import helmert

from hdcal.data.records import Array

# Most lots, operators or rigs that are distinguished.
MOST_GROUPS = 40
# Share of a size below which nothing scatters.
_NOTHING = 1e-6


class Grouping(eqx.Module):
    """Estimates of orthonormal contrasts, which shape the coordinates only."""

    basis: Float[Array, "k c"]
    estimate: Float[Array, " c"]
    variance: Float[Array, " c"]

    @property
    def offsets(self) -> np.ndarray:
        """Estimated distance of each group from the mean of all, shape (k,)."""
        return np.asarray(self.basis @ self.estimate)


def grouping(means: np.ndarray, covariance: np.ndarray) -> Grouping:
    """Return groups from their means, shape (k,), and the covariance of these."""
    basis = helmert(len(means)).T
    return Grouping(basis, basis.T @ means, np.diag(basis.T @ covariance @ basis))


def sample_offsets(kind: str, groups: Grouping, sd) -> dict:
    """Sample the distance of each group from the mean of all, as `kind`_1, …."""
    weight = sd**2 / (sd**2 + groups.variance)
    scale = jnp.sqrt(weight * groups.variance)
    plain, places = dist.Normal(0.0, 1.0), range(1, len(groups.basis))
    u = jnp.stack([numpyro.sample(f"_{kind}_{place}", plain) for place in places])
    contrast = weight * groups.estimate + scale * u
    log_prior = (
        dist.Normal(0.0, sd).log_prob(contrast) + jnp.log(scale) - plain.log_prob(u)
    )
    numpyro.factor(f"_{kind}_prior", jnp.sum(log_prior))
    offsets = groups.basis @ contrast
    names = (f"{kind}_{place}" for place in range(1, len(offsets) + 1))
    return {
        name: numpyro.deterministic(name, offset)
        for name, offset in zip(names, offsets, strict=True)
    }


def group_offsets(values: Mapping, kind: str) -> Float[Array, "k ..."]:
    """Return the distance of each group from the mean of all; a zero without groups."""
    names = [name for name in values if name.removeprefix(f"{kind}_").isdigit()]
    names.sort(key=lambda name: int(name.removeprefix(f"{kind}_")))
    if not names:
        return jnp.zeros_like(next(iter(values.values())))[None]
    return jnp.stack([values[name] for name in names])


def distinguished(labels: Sequence[str]) -> tuple[list[str], np.ndarray]:
    """Return the names of groups and the group of each label.

    No groups if there is one group, more than `MOST_GROUPS`, or one per label.
    """
    names, index = np.unique(np.array(labels, str), return_inverse=True)
    if 1 < len(names) <= min(MOST_GROUPS, len(labels) - 1):
        return names.tolist(), index
    return [], np.zeros(len(labels), int)


def medians_of_groups(values: np.ndarray, group: np.ndarray) -> Grouping:
    """Return groups of members by their medians, which outliers do not move."""
    middle = _medians(values, group)
    sd = robust_sd(values - middle[group])
    least = _NOTHING * np.max(np.abs(values))
    return grouping(middle, np.diag(max(sd, least) ** 2 / np.bincount(group)))


def gains_of_rigs(
    value: np.ndarray, variance: np.ndarray, gear: np.ndarray, rig: np.ndarray
) -> Grouping:
    """Return the gains of rigs by least squares, as shares of the stiffness.

    A gear measured on several rigs compares them with the error of its slopes; a gear
    measured on one rig only with the scatter between gears. A value is the relative
    slope of a gear on a rig, with the variance of its error; all have shape (r,).
    """
    rigs, weight = 1 + int(rig.max()), 1.0 / variance
    apart = value - _medians(value, rig)[rig]
    own_sd = np.full(1 + int(gear.max()), robust_sd(apart))
    np.maximum.at(own_sd, gear, np.abs(apart))
    known = np.zeros((len(own_sd), rigs))
    known[gear, rig] = weight
    # What rigs share of a gear is its stiffness, which is integrated out.
    shared = known.T / (1.0 / np.maximum(own_sd, _NOTHING) ** 2 + known.sum(axis=1))
    pull = np.bincount(rig, weight * value)
    pull -= shared @ np.bincount(gear, weight * value)
    # A gain about which nothing is known has an sd of one.
    covariance = np.linalg.inv(np.diag(1.0 + known.sum(axis=0)) - shared @ known)
    return grouping(covariance @ pull, covariance)


def robust_sd(values: np.ndarray) -> float:
    """Return the sd of normal values about zero by their median size."""
    return float(np.median(np.abs(values)) / scipy.special.ndtri(0.75))


def _medians(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    return np.array([np.median(values[group == k]) for k in range(group.max() + 1)])
