"""Ways to look at one effect of the registry, shared by the tests of effects."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from readings import draw_reading

from hdcal import EFFECTS
from hdcal.inference.likelihood import log_probability
from hdcal.physics.chain import Base, predict_reading
from hdcal.physics.effect import Effect, parameters

# What no table of readings on the gear holds: an effect that needs it is never tested.
BEYOND_RECORDS = frozenset({"bare_rig"})

everyone = pytest.mark.parametrize("name", sorted(EFFECTS))
compiled_chain = jax.jit(predict_reading)


@jax.jit
def _applied(effect, signal, rows):
    return effect.apply(signal, rows)


@dataclasses.dataclass(frozen=True)
class Compiled:
    """An effect whose contribution is a program of its own.

    The chain around it runs as it stands: so many chains share a few programs.
    """

    effect: Effect

    @property
    def stage(self) -> str:
        """The stage of the effect."""
        return self.effect.stage

    def apply(self, signal, rows):
        """Return the signal as the effect leaves it."""
        return _applied(self.effect, signal, rows)


def typical(name: str, **changes: float) -> Effect:
    """Return the effect at its typical size, some parameters changed."""
    declared = parameters(EFFECTS[name])
    sizes = {field: about.typical for field, about in declared.items()}
    return EFFECTS[name](**(sizes | changes))


def null(name: str) -> Effect:
    """Return the effect with every amplitude at its null value."""
    declared = parameters(EFFECTS[name])
    amplitudes = {f: p.null for f, p in declared.items() if p.null is not None}
    assert amplitudes, f"{name} has no amplitude"
    return typical(name, **amplitudes)


def bare(base: Base) -> Base:
    """Return the base without anything that mixes with an effect."""
    return Base(base.stiffness, 0.0, 0.0, 0.0, base.sigma)


def density(errors, noise):
    """Return the probability density of errors at every row [1/N]."""
    grid = errors[:, None, None] / noise.sd
    each = jnp.exp(noise.log_weight[:, None] - 0.5 * grid**2) / noise.sd
    return jnp.sum(each, axis=1) / np.sqrt(2.0 * np.pi)


def difference(chain, other, base) -> np.ndarray:
    """Return how readings and noise of two chains differ, as one vector.

    The noise is a mixture, so what counts is its density, here at a few errors.
    """
    errors = base.sigma * jnp.array([0.0, 0.7, 2.0, 4.0])
    parts = [
        np.concatenate([mean, np.ravel(density(errors, noise))])
        for mean, noise in (chain, other)
    ]
    return parts[0] - parts[1]


def contribution(effects, others, base, records, reading) -> np.ndarray:
    """Return what effects add to the reading and to its noise, as one vector."""
    with_effects, without = (
        compiled_chain(base, tuple(chosen), records, reading)
        for chosen in ((*others, *effects), others)
    )
    return difference(with_effects, without, base)


@jax.jit
def score(effects, base, records, reading):
    """Return one number to which every stage contributes."""
    mean, noise = predict_reading(base, effects, records, reading)
    rows = log_probability(records.force, mean, noise, 0.0, rounded=False)
    return jnp.sum(rows) + jnp.vdot(jnp.cos(jnp.arange(len(mean))), mean)


score_and_slope = jax.jit(jax.value_and_grad(score, argnums=(0, 1, 2)))


def noisy(loading, base, reading, effects):
    """Return the records with readings of the chain itself."""
    mean, noise = compiled_chain(base, tuple(effects), loading, reading)
    drawn = draw_reading(jax.random.key(len(mean)), mean, noise)
    return dataclasses.replace(loading, force=drawn)


def numbers(records):
    """Return the records with labels as numbers too, so that all can be varied."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, float), records)
