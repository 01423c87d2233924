"""Many gears at once: the population is sampled, its gears are integrated out exactly.

A mounting's readings are y = s x + z + e, with s of its gear, z = zero + N(0,
mounting_sd²) its own, and e ~ N(0, σ²) with a σ of its gear. About a gear's σ and its
kind (ordinary or off) all is Gaussian in s, so that the mounting's readings say no more
than seven sums. σ is integrated by Gauss and Hermite's rule, the kind by its two cases.
"""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Float, Int

from hdcal.data.prior import Prior
from hdcal.data.records import Array
from hdcal.inference.density import log_likelihood
from hdcal.inference.model import model, sample_site
from hdcal.inference.sampled_problem import Sampled

# Nodes of the noise of a gear about that of all: places in sds, and weights.
_NODES = 7
_PLACES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(_NODES)
_LOG_WEIGHTS = np.log(_WEIGHTS / _WEIGHTS.sum())

# Sites that a population adds to those of a gear.
POPULATION_PRIORS: Mapping[str, Prior] = {
    "noise_spread": Prior(
        "half_normal",
        (0.3,),
        "1",
        "engineering judgement: gears on one rig are read with noise that differs by "
        "up to a factor of two",
    ),
    "off_share": Prior(
        "beta",
        (1.0, 9.0),
        "1",
        "engineering judgement: one gear in ten is off, or fewer",
    ),
    "off_ratio": Prior(
        "lognormal",
        (6.0, 0.7),
        "1",
        "engineering judgement: gears that are off lie some six times as far from the "
        "centre as ordinary ones",
    ),
}


class MountingSums(eqx.Module):
    """What the readings of each mounting say, one entry each.

    Attributes:
        gear: index of its gear.
        rows: number of readings [-].
        x: mean deformation as read, at the modulus of its temperature [mm].
        y: mean force [N].
        xx: squares about the mean, summed [mm²].
        xy: products likewise [N mm].
        yy: squares likewise [N²].
    """

    gear: Int[Array, " m"]
    rows: Float[Array, " m"]
    x: Float[Array, " m"]
    y: Float[Array, " m"]
    xx: Float[Array, " m"]
    xy: Float[Array, " m"]
    yy: Float[Array, " m"]


class PopulationProblem(Sampled):
    """Gears of one kind, measured alike.

    Attributes:
        priors: by site: stiffness [N/mm as read], specimen_sd, zero [N],
            run_offset_sd [N], sigma [N] and those of `POPULATION_PRIORS`.
        sums: of every mounting.
        gears: an entry for each; its values mean nothing.
    """

    priors: dict[str, Prior]
    sums: MountingSums
    gears: Float[Array, " g"]


class GearLaw(NamedTuple):
    """Of each gear given one draw of the population; [gear, node, kind].

    Attributes:
        log_weight: of noise and kind, normalised over both.
        mean: of the stiffness [N/mm].
        sd: of it [N/mm].
        far: how far the readings are from the centre, in sds of an ordinary gear with
            its noise; [gear, node].
    """

    log_weight: Float[Array, "g u k"]
    mean: Float[Array, "g u k"]
    sd: Float[Array, "g u k"]
    far: Float[Array, "g u"]


def _joint(problem: PopulationProblem, values: Mapping) -> GearLaw:
    """Return log p(readings of a gear, noise, kind), and its stiffness given these."""
    sums, size = problem.sums, len(problem.gears)
    centre = values["stiffness"]
    sigma = values["sigma"] * jnp.exp(values["noise_spread"] * _PLACES)
    variance = jnp.broadcast_to(sigma[None] ** 2, (len(sums.rows), _NODES))
    of_mean = values["run_offset_sd"] ** 2 + variance / sums.rows[:, None]
    # Sums about a gear of the population's centre.
    rest_y = (sums.y - centre * sums.x - values["zero"])[:, None]
    rest_xy = (sums.xy - centre * sums.xx)[:, None]
    rest_yy = (sums.yy - 2.0 * centre * sums.xy + centre**2 * sums.xx)[:, None]
    x, xx = sums.x[:, None], sums.xx[:, None]
    parts = jnp.stack(
        [
            xx / variance + x**2 / of_mean,
            rest_xy / variance + x * rest_y / of_mean,
            rest_yy / variance + rest_y**2 / of_mean,
            (sums.rows[:, None] - 1.0) * jnp.log(variance) + jnp.log(of_mean),
        ]
    )
    whole = jax.vmap(lambda part: jax.ops.segment_sum(part, sums.gear, size))(parts)
    precision, slope, square, volume = whole[..., None]
    ordinary = values["specimen_sd"] * centre
    kinds = jnp.stack([jnp.ones(()), jnp.sqrt(1.0 + values["off_ratio"] ** 2)])
    between = (ordinary * kinds) ** 2
    share = values["off_share"]
    shrunk = 1.0 + between * precision
    log_joint = (
        -0.5 * (square + volume + jnp.log(shrunk) - slope**2 * between / shrunk)
        + _LOG_WEIGHTS[:, None]
        + jnp.log(jnp.stack([1.0 - share, share]))
    )
    mean = centre + slope * between / shrunk
    far = (slope / jnp.sqrt(precision * shrunk))[..., 0]
    return GearLaw(log_joint, mean, jnp.sqrt(between / shrunk), far)


@log_likelihood.register
def _(problem: PopulationProblem, values: Mapping) -> Float[Array, ""]:
    joint = _joint(problem, values).log_weight
    return jnp.sum(jax.nn.logsumexp(joint, axis=(1, 2)))


@model.register
def _(problem: PopulationProblem) -> None:
    values = {name: sample_site(name, p) for name, p in problem.priors.items()}
    numpyro.factor("force", log_likelihood(problem, values))


def gear_law(problem: PopulationProblem, values: Mapping) -> GearLaw:
    """Return what is known of each gear given one draw of the population."""
    found = _joint(problem, values)
    whole = jax.nn.logsumexp(found.log_weight, axis=(1, 2), keepdims=True)
    return found._replace(log_weight=found.log_weight - whole)


class DrawnGears(NamedTuple):
    """Draws of every gear, one for each draw of the population; [draw, gear].

    Attributes:
        stiffness: [N/mm as read].
        noise_sd: [N].
        off: probability that it is no ordinary one.
        chance: that an ordinary one is as far from the centre.
    """

    stiffness: Float[Array, "t g"]
    noise_sd: Float[Array, "t g"]
    off: Float[Array, "t g"]
    chance: Float[Array, "t g"]


@jax.jit
def draw_gears(problem: PopulationProblem, values: Mapping, key) -> DrawnGears:
    """Draw every gear from what is known of it given each draw of the population.

    Args:
        problem: the gears.
        values: draws of the population by site, shape (t,).
        key: source of randomness.
    """

    def one(drawn):
        draw, key = drawn
        law = gear_law(problem, draw)
        which, where = jax.random.split(key)
        flat = law.log_weight.reshape(len(problem.gears), -1)
        case = jax.random.categorical(which, flat)[:, None]
        mean, sd = (
            jnp.take_along_axis(part.reshape(flat.shape), case, axis=1)[:, 0]
            for part in (law.mean, law.sd)
        )
        stiffness = mean + sd * jax.random.normal(where, mean.shape)
        place = jnp.asarray(_PLACES)[case[:, 0] // 2]
        noise = draw["sigma"] * jnp.exp(draw["noise_spread"] * place)
        off = jnp.exp(jax.nn.logsumexp(law.log_weight[..., 1], axis=1))
        weight = jax.nn.softmax(law.log_weight[..., 1], axis=1)
        chance = jnp.sum(weight * 2.0 * jax.scipy.stats.norm.sf(abs(law.far)), axis=1)
        return DrawnGears(stiffness, noise, off, chance)

    keys = jax.random.split(key, len(values["stiffness"]))
    # One after the other: a hundred thousand gears side by side fill the memory.
    return jax.lax.map(one, (values, keys))
