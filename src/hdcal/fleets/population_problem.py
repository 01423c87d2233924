"""Many gears at once: the population is sampled, its gears are integrated out exactly.

A mounting's readings are y = s x + z + e, with s of its gear, z = zero + N(0,
mounting_sd²) its own, and e ~ N(0, σ²) with a σ of its gear. About a gear's σ and its
kind (ordinary or off) all is Gaussian in s: readings say no more than sums. σ is
integrated by Gauss and Hermite's rule, the kind by its two cases. Where lots are told,
each has a centre of its own, where operators are, each a zero of its own, and where
rigs are, each a gain of its own: on it a gear's s is larger by that share.
"""

from collections.abc import Mapping
from dataclasses import field
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Float

from hdcal.data.prior import Prior
from hdcal.data.records import Array
from hdcal.exported import jit
from hdcal.fleets.gear_sums import GearSums, line_noise, stretched
from hdcal.fleets.groupings import Grouping, group_offsets, sample_offsets
from hdcal.inference.likelihood import log_likelihood
from hdcal.inference.model import sample_site
from hdcal.inference.sampled_problem import Sampled

# Nodes of the noise of a gear about where it likely is: places in sds, and weights.
_NODES = 4
_PLACES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(_NODES)
_LOG_WEIGHTS = np.log(_WEIGHTS / _WEIGHTS.sum())

# Newton's steps to where it likely is.
_NEWTON = 8

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


# Scatter of groups in that of their members, before the data, and the site of these.
GROUP_RATIO = Prior(
    "lognormal",
    (0.7, 1.2),
    "1",
    "engineering judgement: lots scatter about as gears of one lot do, seldom a tenth "
    "of it or seven times as far; operators' zeros as those of mountings, and rigs' "
    "gains as gears",
)
_MEMBERS = {"lot": "specimen_sd", "operator": "run_offset_sd", "rig": "specimen_sd"}


class PopulationProblem(Sampled):
    """Gears of one kind, measured alike.

    Attributes:
        priors: by site: stiffness [N/mm as read], specimen_sd, zero [N],
            run_offset_sd [N], sigma [N] and those of `POPULATION_PRIORS`; where they
            are told lot_ratio, operator_ratio and rig_ratio.
        sums: of every gear.
        groups: lots, operators and rigs, where they are told.
    """

    priors: dict[str, Prior]
    sums: GearSums
    groups: dict[str, Grouping] = field(default_factory=dict)

    def declare(self) -> None:
        """Declare the joint density of the population and all readings to NumPyro."""
        values = {name: sample_site(name, p) for name, p in self.priors.items()}
        for kind, groups in self.groups.items():
            spread = values[f"{kind}_ratio"] * values[_MEMBERS[kind]]
            numpyro.deterministic(f"{kind}_sd", spread)
            values |= sample_offsets(kind, groups, spread)
        numpyro.factor("force", log_likelihood(self, values))


class GearLaw(NamedTuple):
    """Of each gear given one draw of the population; [gear, node, kind].

    Attributes:
        log_weight: of noise and kind, normalised over both.
        mean: of the stiffness [N/mm].
        sd: of it [N/mm].
        noise_sd: [N]; [gear, node].
        far: how far the readings are from the centre, in sds of an ordinary gear with
            its noise; [gear, node].
    """

    log_weight: Float[Array, "g u k"]
    mean: Float[Array, "g u k"]
    sd: Float[Array, "g u k"]
    noise_sd: Float[Array, "g u"]
    far: Float[Array, "g u"]


def _joint(problem: PopulationProblem, values: Mapping) -> GearLaw:
    """Return log p(readings of a gear, noise, kind), and its stiffness given these."""
    gain = 1.0 + group_offsets(values, "rig")[problem.sums.rig]
    sums = stretched(problem.sums, gain)
    sigma, log_weight = _noise_nodes(sums, values)
    sums = jax.tree.map(lambda column: column[..., None], sums)
    centre = gear_centres(values, problem.sums.lot)[:, None, None]
    by = group_offsets(values, "operator")[problem.sums.operator]
    zero = values["zero"] + by[..., None]
    noise = sigma[:, None] ** 2
    of_mean = values["run_offset_sd"] ** 2 + noise / sums.rows
    # Sums about a gear of the population's centre, whose zeros are in the middle.
    rest_xy = sums.xy - centre * sums.xx - zero * sums.x
    rest_yy = (
        sums.yy
        - 2.0 * (centre * sums.xy + zero * sums.y)
        + centre * (centre * sums.xx + 2.0 * zero * sums.x)
        + zero**2 * sums.mountings
    )
    own_xy = sums.own_xy - centre * sums.own_xx
    own_yy = sums.own_yy - centre * (sums.own_xy + own_xy)
    log_noise = (sums.rows - 1.0) * jnp.log(noise) + jnp.log(of_mean)

    def whole(part):
        return jnp.sum(part, axis=1)[..., None]

    precision = whole(sums.own_xx / noise + sums.xx / of_mean)
    slope = whole(own_xy / noise + rest_xy / of_mean)
    square = whole(own_yy / noise + rest_yy / of_mean)
    volume = whole(sums.mountings * log_noise)
    ordinary = values["specimen_sd"] * centre
    kinds = jnp.stack([jnp.ones(()), jnp.sqrt(1.0 + values["off_ratio"] ** 2)])
    between = (ordinary * kinds) ** 2
    share = values["off_share"]
    shrunk = 1.0 + between * precision
    log_joint = (
        -0.5 * (square + volume + jnp.log(shrunk) - slope**2 * between / shrunk)
        + log_weight[..., None]
        + jnp.log(jnp.stack([1.0 - share, share]))
    )
    mean = centre + slope * between / shrunk
    far = (slope / jnp.sqrt(precision * shrunk))[..., 0]
    return GearLaw(log_joint, mean, jnp.sqrt(between / shrunk), sigma, far)


def gear_centres(values: Mapping, lot) -> Float[Array, "g ..."]:
    """Return the stiffness about which the gears of each gear's lot scatter [N/mm].

    A lot's offset is a share of the stiffness.

    Args:
        values: of the population, of one draw or of many.
        lot: of each gear, shape (g,).
    """
    return values["stiffness"] * (1.0 + group_offsets(values, "lot"))[lot]


def _noise_nodes(sums: GearSums, values: Mapping):
    """Return noise sds of a gear [N] and the logs of their weights, both [gear, node].

    A gear's own line leaves ν degrees of freedom of the noise sd s, which say
    -ν (log σ + ½ s²/σ²) of log σ. Nodes lie about the mode of that and the law of all,
    and as far apart as it is wide: those of the law of all would miss what many
    readings say.
    """
    spread, (free, log_sd) = values["noise_spread"], line_noise(sums)
    pull, own = free * spread, log_sd - jnp.log(values["sigma"])
    # In sds of the law of all, about its centre.
    mode = 2.0 * pull * own / (1.0 + 2.0 * pull * spread)
    for _ in range(_NEWTON):
        square = pull * jnp.exp(2.0 * (own - spread * mode))
        mode += (square - pull - mode) / (1.0 + 2.0 * spread * square)
    square = pull * jnp.exp(2.0 * (own - spread * mode))
    width = 1.0 / jnp.sqrt(1.0 + 2.0 * spread * square)
    # Where nodes lie moves the integral by the rule's error only: what is left out of
    # the gradient bends trajectories a little, and no draw, whose density is exact.
    mode, width = jax.lax.stop_gradient((mode, width))
    place = mode[:, None] + width[:, None] * _PLACES
    log_weight = _LOG_WEIGHTS + 0.5 * (_PLACES**2 - place**2) + jnp.log(width)[:, None]
    return values["sigma"] * jnp.exp(spread * place), log_weight


@log_likelihood.register
def _(problem: PopulationProblem, values: Mapping) -> Float[Array, ""]:
    joint = _joint(problem, values).log_weight
    return jnp.sum(jax.nn.logsumexp(joint, axis=(1, 2)))


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


@jit
def draw_gears(problem: PopulationProblem, values: Mapping, seed: int) -> DrawnGears:
    """Draw every gear from what is known of it given each draw of the population.

    Args:
        problem: the gears.
        values: draws of the population by site, shape (t,).
        seed: of the draws.
    """

    def one(drawn):
        draw, key = drawn
        law = gear_law(problem, draw)
        which, where = jax.random.split(key)
        flat = law.log_weight.reshape(len(law.far), -1)
        case = jax.random.categorical(which, flat)[:, None]
        mean, sd = (
            jnp.take_along_axis(part.reshape(flat.shape), case, axis=1)[:, 0]
            for part in (law.mean, law.sd)
        )
        stiffness = mean + sd * jax.random.normal(where, mean.shape)
        noise = jnp.take_along_axis(law.noise_sd, case // 2, axis=1)[:, 0]
        off = jnp.exp(jax.nn.logsumexp(law.log_weight[..., 1], axis=1))
        weight = jax.nn.softmax(law.log_weight[..., 1], axis=1)
        chance = jnp.sum(weight * 2.0 * jax.scipy.stats.norm.sf(abs(law.far)), axis=1)
        return DrawnGears(stiffness, noise, off, chance)

    own = jax.random.fold_in(jax.random.key(seed), 1)
    keys = jax.random.split(own, len(values["stiffness"]))
    # One after the other: a hundred thousand gears side by side fill the memory.
    return jax.lax.map(one, (values, keys))
