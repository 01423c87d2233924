"""The best that anyone could do: Bayes with the size and the noise given away.

The oracle knows r, σ, that the noise is independent, the true base model about which
curves are made, and the priors of shapes and signs; every effect that reaches r is
equally likely. It does not know which effect it is, its shape, nor its sign.
"""

import numpy as np
from scipy.special import gammaln, ive, logsumexp

from benchmarks.diagnosis.causes import (
    directions,
    reaching,
    several,
    shapes,
    signs,
    testable,
)
from benchmarks.diagnosis.world import World


def judge(world: World, force: np.ndarray, r: float) -> dict[str, float]:
    """Return the oracle's probability of each effect.

    Args:
        world: what the oracle is told.
        force: the readings [N].
        r: visible size of the effect.
    """
    # In units of σ; `left` is symmetric and integrates the base parameters out.
    reading = world.left @ (force - world.plain) / world.sigma
    found = {}
    for name in testable(world.records):
        value = _several(name, world, reading, r) if several(name) else None
        found[name] = _single(name, world, reading, r) if value is None else value
    found = {n: v for n, v in found.items() if np.isfinite(v)}
    total = logsumexp(list(found.values()))
    return {name: float(np.exp(value - total)) for name, value in found.items()}


def _single(name: str, world: World, reading: np.ndarray, r: float) -> float:
    both = [reaching(name, world, r, shapes(name), sign)[0] for sign in signs(name)]
    curves = np.concatenate(both) / world.sigma
    if not len(curves):
        return -np.inf
    energy = np.einsum("sn,nm,sm->s", curves, world.left, curves, optimize=True)
    return float(logsumexp(curves @ reading - 0.5 * energy) - np.log(len(curves)))


def _several(name: str, world: World, reading: np.ndarray, r: float) -> float:
    """Return the log evidence over all directions of several amplitudes.

    On the sphere of size r the likelihood is that of von Mises and Fisher; the prior
    of the direction, normal amplitudes scaled to r, is taken at its mode.
    """
    found = []
    for columns in directions(name, world, shapes(name)) / world.sigma:
        strength, axes = np.linalg.eigh(columns @ world.left @ columns.T)
        kept = strength > 1e-9 * strength[-1]
        strength, axes = strength[kept], axes[:, kept]
        along = axes.T @ (columns @ reading) / np.sqrt(strength)
        length = np.linalg.norm(along)
        radius = r * np.sqrt(len(reading))
        count = len(strength)
        mode = along / length
        prior = -0.5 * np.sum(np.log(strength))
        prior -= 0.5 * count * np.log(np.sum(mode**2 / strength))
        found.append(_sphere(count, radius * length) - 0.5 * radius**2 + prior)
    return float(logsumexp(found) - np.log(len(found)))


def _sphere(count: int, pull: float) -> float:
    """Return the log mean of exp(pull · cos) over the unit sphere of a dimension."""
    half = 0.5 * count - 1.0
    bessel = np.log(ive(half, pull)) + pull
    return float(gammaln(0.5 * count) - half * np.log(0.5 * pull) + bessel)
