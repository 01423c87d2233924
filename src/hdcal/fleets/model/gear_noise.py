"""Noise of the readings of every gear: ordinary gears differ little, a few a lot.

The log likelihood of the noise σ of a gear is −ν (log σ + ½ s²/σ²), given its residual
sd s with ν degrees of freedom. log σ is normal about the centre of all gears; of an
outlier it is wider by √(1 + ratio²). σ is integrated by Gauss and Hermite's rule about
its mode.
"""

from collections.abc import Mapping
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
from jaxtyping import Float

from hdcal.data.prior import Prior
from hdcal.data.records import Array
from hdcal.fleets.model.gear_quantity import NoiseNodes, off_probability
from hdcal.inference.force_model.model import sample_site
from hdcal.inference.sampled_problem import Sampled, Values

Cells = Float[Array, "g u k"]
# Nodes about the mode: places in standard deviations, and weights.
_PLACES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(4)
_LOG_WEIGHTS = np.log(_WEIGHTS / _WEIGHTS.sum())
# Newton steps to the mode.
_NEWTON = 8


class GearNoise(Sampled):
    """Degrees of freedom, 0 where none is known, and log residual sd of every gear."""

    priors: dict[str, Prior]
    freedom: Float[Array, " g"]
    log_sd: Float[Array, " g"]

    def some(self, gears: np.ndarray) -> "GearNoise":
        """Return the residuals of the gears with these indices."""
        return replace(self, freedom=self.freedom[gears], log_sd=self.log_sd[gears])

    def declare(self) -> None:
        """Declare the joint density of the population and all residuals to NumPyro."""
        values = {name: sample_site(name, p) for name, p in self.priors.items()}
        numpyro.factor("residuals", self.log_likelihood(values))

    def log_likelihood(self, values: Values) -> Float[Array, ""]:
        """Return the log density of all residuals, with the noise integrated out."""
        joint, _ = noise_posterior(self, values)
        return jnp.sum(jax.nn.logsumexp(joint, axis=(1, 2)))


def noise_posterior(problem: GearNoise, values: Mapping) -> tuple[Cells, Cells]:
    """Return log density of residuals, node and kind of gears, and log of the noise."""
    wide = jnp.stack([jnp.ones(()), jnp.sqrt(1.0 + values["off_ratio"] ** 2)])
    spread = values["spread"] * wide
    own = (problem.log_sd - jnp.log(values["centre"]))[:, None]
    mode, width = _mode(problem.freedom[:, None], own, spread)
    places = _PLACES[:, None]
    place = mode[:, None] + width[:, None] * places
    away = spread * place - own[:, None]
    free = problem.freedom[:, None, None]
    share = values["off_share"]
    log_joint = (
        -free * (away + 0.5 * jnp.exp(-2.0 * away))
        + _LOG_WEIGHTS[:, None]
        + 0.5 * (places**2 - place**2)
        + jnp.log(width)[:, None]
        + jnp.log(jnp.stack([1.0 - share, share]))
    )
    return log_joint, jnp.log(values["centre"]) + spread * place


def _mode(free, own, spread):
    """Return where log σ likely lies, in its own sds about the centre, and its sd."""
    # Far below the residual sd the gradient grows exponentially, so Newton's method
    # starts above it.
    mode = jnp.where(free > 0.0, own / spread, 0.0)
    mode = 2.0 * free * spread**2 * mode / (1.0 + 2.0 * free * spread**2)
    for _ in range(_NEWTON):
        square = free * spread * jnp.exp(2.0 * (own - spread * mode))
        mode += (square - free * spread - mode) / (1.0 + 2.0 * spread * square)
    square = free * spread * jnp.exp(2.0 * (own - spread * mode))
    width = 1.0 / jnp.sqrt(1.0 + 2.0 * spread * square)
    # Where nodes lie changes the integral by the error of the rule only. Their
    # derivative is omitted. This affects the proposals slightly, not the accepted
    # density.
    return jax.lax.stop_gradient((mode, width))


@jax.jit
def _moments(problem: GearNoise, values: Mapping):
    """Return mean and sd of log σ and the probability of being an outlier; [gear]."""

    def one(draw):
        log_joint, log_sd = noise_posterior(problem, draw)
        weight = jax.nn.softmax(log_joint, axis=(1, 2))
        first, second = (jnp.sum(weight * log_sd**p, axis=(1, 2)) for p in (1, 2))
        return first, second, off_probability(log_joint)

    first, second, off = (
        jnp.mean(part, axis=0) for part in jax.lax.map(one, dict(values))
    )
    return first, jnp.sqrt(jnp.maximum(second - first**2, 0.0)), off


def gear_noise(
    problem: GearNoise, values: Mapping
) -> tuple[NoiseNodes, np.ndarray, np.ndarray]:
    """Return nodes of the noise of gears, their median [N], and P(outlier).

    They are averages over draws of the population, shape (g,).
    """
    middle, sd, off = _moments(problem, values)
    nodes = jnp.exp(middle[:, None] + sd[:, None] * _PLACES)
    return NoiseNodes(nodes, jnp.asarray(_LOG_WEIGHTS)), np.exp(middle), np.asarray(off)
