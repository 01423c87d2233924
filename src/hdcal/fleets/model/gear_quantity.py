"""One quantity of every gear: ordinary gears scatter about a centre, a few lie far out.

A row of a gear holds y = m + a (θ + δ) + ε. θ of an ordinary gear is N(0, spread²),
that of an outlier is wider by √(1 + ratio²). δ ~ N(0, s σ²) is an error that all rows
of a gear share, ε ~ N(0, c σ²) that of the row. σ is the noise of the readings of the
gear; it is integrated over `NoiseNodes`. Given σ and the kind of the gear all of it is
Gaussian, so that a gear is integrated out exactly.

m = centre (1 + lot) (1 + rig) + operator. Of the stiffness θ and δ are shares: a = m;
of any other quantity a = 1. Zeros scatter from row to row: ε then has spread² more, and
θ is zero but for outliers, where it is N(0, (ratio · spread)²).

Source:
    Box and Tiao, Biometrika 55 (1968), the wide component; Efron, Statistical Science
    23 (2008), the local false-discovery rate.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Float, Int

from hdcal.data.prior import Prior
from hdcal.data.records import Array
from hdcal.fleets.model.groups import Grouping, group_offsets, sample_offsets
from hdcal.inference.force_model.model import sample_site
from hdcal.inference.sampled_problem import Sampled, Values

# The local false-discovery rate up to which a gear is flagged: odds of three to one.
MOST_FALSE = 0.25


class NoiseNodes(eqx.Module):
    """Noise sd of the readings of each gear [N] as nodes with weights."""

    sd: Float[Array, "g u"]
    log_weight: Float[Array, " u"]


class GearQuantity(Sampled):
    """Rows that hold one quantity of every gear; [gear, row].

    All quantities have one structure, so that one compiled program serves them.

    Attributes:
        priors: of _centre, the centre or its logarithm, and of the other sites.
        value: y; the error is c.
        present: 1, or 0 where a gear has no more rows.
        rig: index; 0 where rigs are not distinguished; likewise operator and lot.
        shared: s of each gear.
        relative: 1 where θ is a share of a positive centre, else 0.
        by_row: 1 where rows scatter and not gears, else 0.
    """

    priors: dict[str, Prior]
    value: Float[Array, "g s"]
    error: Float[Array, "g s"]
    present: Float[Array, "g s"]
    rig: Int[Array, "g s"]
    operator: Int[Array, "g s"]
    shared: Float[Array, " g"]
    lot: Int[Array, " g"]
    noise: NoiseNodes
    groups: dict[str, Grouping]
    relative: Float[Array, ""]
    by_row: Float[Array, ""]

    def some(self, gears: np.ndarray) -> "GearQuantity":
        """Return the rows of some gears, by their indices."""
        by_gear = ("value", "error", "present", "rig", "operator", "shared", "lot")
        some = {name: np.asarray(getattr(self, name))[gears] for name in by_gear}
        noise = replace(self.noise, sd=self.noise.sd[gears])
        return replace(self, noise=noise, **some)

    def declare(self) -> None:
        """Declare the joint density of the population and all rows to NumPyro."""
        values = {name: sample_site(name, p) for name, p in self.priors.items()}
        place = values.pop("_centre")
        # The exponential of a force of 1 kN has no gradient, used or not.
        log_centre = jnp.where(self.relative > 0.0, place, 0.0)
        centre = jnp.where(self.relative > 0.0, jnp.exp(log_centre), place)
        values["centre"] = numpyro.deterministic("centre", centre)
        for kind, groups in self.groups.items():
            spread = values[f"{kind}_ratio"] * values["spread"]
            numpyro.deterministic(f"{kind}_sd", spread)
            values |= sample_offsets(kind, groups, spread)
        numpyro.factor("rows", self.log_likelihood(values))

    def log_likelihood(self, values: Values) -> Float[Array, ""]:
        """Return the log density of all rows, with the gears integrated out."""
        joint = gear_posterior(self, values).log_joint
        return jnp.sum(jax.nn.logsumexp(joint, axis=(1, 2)))


class GearPosterior(NamedTuple):
    """Joint log density of rows, noise node and kind of a gear; mean and sd of θ."""

    log_joint: Float[Array, "g u k"]
    mean: Float[Array, "g u k"]
    sd: Float[Array, "g u k"]


def gear_posterior(problem: GearQuantity, values: Mapping) -> GearPosterior:
    """Return the posterior of θ of each gear, given one draw of the population."""
    lot = group_offsets(values, "lot")[problem.lot][:, None]
    rig = group_offsets(values, "rig")[problem.rig]
    operator = group_offsets(values, "operator")[problem.operator]
    mean = values["centre"] * (1.0 + lot) * (1.0 + rig) + operator
    load = jnp.where(problem.relative > 0.0, mean, 1.0)[..., None]
    noise = problem.noise.sd**2
    scatter = values["spread"] ** 2
    # [gear, row, node]
    own = problem.by_row * scatter + problem.error[..., None] * noise[:, None, :]
    rest = (problem.value - mean)[..., None]

    def summed(rows):
        return jnp.sum(problem.present[..., None] * rows, axis=1)[..., None]

    precision = summed(load**2 / own)
    pull = summed(load * rest / own)
    square = summed(rest**2 / own + jnp.log(own))
    odd = jnp.stack([jnp.zeros(()), values["off_ratio"] ** 2])
    between = scatter * (1.0 - problem.by_row + odd)
    total = between + problem.shared[:, None, None] * noise[..., None]
    shrunk = 1.0 + total * precision
    share = values["off_share"]
    log_joint = (
        -0.5 * (square + jnp.log(shrunk) - pull**2 * total / shrunk)
        + problem.noise.log_weight[:, None]
        + jnp.log(jnp.stack([1.0 - share, share]))
    )
    gain = between / shrunk
    # The variance of θ alone, without the error that its rows share.
    variance = jnp.maximum(between - between * gain * precision, 0.0)
    return GearPosterior(log_joint, gain * pull, jnp.sqrt(variance))


class DrawnGears(NamedTuple):
    """θ of every gear, and P(outlier), for each population draw."""

    apart: Float[Array, "t g"]
    off: Float[Array, "t g"]


@jax.jit
def draw_gears(problem: GearQuantity, values: Mapping, seed: int) -> DrawnGears:
    """Draw every gear from its posterior given each draw of the population, (t,)."""

    def one(drawn):
        draw, key = drawn
        found = gear_posterior(problem, draw)
        flat = found.log_joint.reshape(len(problem.lot), -1)
        which, where = jax.random.split(key)
        cell = jax.random.categorical(which, flat)[:, None]
        mean, sd = (
            jnp.take_along_axis(part.reshape(flat.shape), cell, axis=1)[:, 0]
            for part in (found.mean, found.sd)
        )
        apart = mean + sd * jax.random.normal(where, mean.shape)
        return DrawnGears(apart, off_probability(found.log_joint))

    keys = jax.random.split(jax.random.key(seed), len(values["off_share"]))
    # One after the other: a hundred thousand gears side by side fill the memory.
    return jax.lax.map(one, (values, keys))


def off_probability(log_joint: Float[Array, "g u k"]) -> Float[Array, " g"]:
    """Return the probability of each gear being an outlier, by its cells."""
    of_kind = jax.nn.logsumexp(log_joint, axis=1)
    return jax.nn.softmax(of_kind, axis=1)[:, 1]
