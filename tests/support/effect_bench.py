"""One effect among all others of the library at their null values.

The structure is that of the whole library, so that one compiled chain serves all.
"""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from readings import draw_reading

from hdcal import EFFECTS
from hdcal.physics.chain import Base, predict_reading
from hdcal.physics.effect import Effect, parameters

# Features that no table of readings on the gear has: such an effect is never tested.
BEYOND_RECORDS = frozenset({"readings of the rig alone"})

every_effect = pytest.mark.parametrize("name", sorted(EFFECTS))
compiled_chain = jax.jit(predict_reading)


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


def library(*names: str) -> tuple[Effect, ...]:
    """Return the library, these effects at their typical sizes and the others null."""
    return tuple(typical(n) if n in names else null(n) for n in EFFECTS)


def bare(base: Base) -> Base:
    """Return the base without offsets and loss of modulus."""
    return Base(base.stiffness, 0.0, 0.0, 0.0, base.sigma)


def difference(chain, other, base) -> np.ndarray:
    """Return how readings and noise of two chains differ, as one vector.

    The noise is a mixture: its density at a few errors is compared.
    """
    errors = base.sigma * np.array([0.0, 0.7, 2.0, 4.0])

    def vector(mean, noise):
        grid = errors[:, None, None] / noise.sd
        each = np.exp(noise.log_weight[:, None] - 0.5 * grid**2) / noise.sd
        density = np.sum(each, axis=1) / np.sqrt(2.0 * np.pi)
        return np.concatenate([mean, np.ravel(density)])

    return vector(*chain) - vector(*other)


def contribution(names, base, records, reading) -> np.ndarray:
    """Return what effects add to the reading and to its noise, as one vector."""
    chains = (
        compiled_chain(base, library(*chosen), records, reading)
        for chosen in (names, ())
    )
    return difference(*chains, base)


def noisy(loading, base, reading, effects):
    """Return the records with readings of the chain itself."""
    mean, noise = compiled_chain(base, tuple(effects), loading, reading)
    drawn = draw_reading(jax.random.key(len(mean)), mean, noise)
    return dataclasses.replace(loading, force=drawn)


def numbers(records):
    """Return the records with labels as numbers too, so that all can be varied."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, float), records)
