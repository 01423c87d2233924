"""Propagation of distributions by Monte Carlo, which a linear budget is held to.

JCGM 101:2008, clauses 5 to 7.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import numpy as np

from hdcal.prediction.budget.inputs import SD_WITHIN, InputGroup
from hdcal.prediction.budget.linear import Model

# Trials of a model that are computed at a time.
_BLOCK = 1 << 17


@dataclass(frozen=True)
class MonteCarlo:
    """Trials of an output, in rising order."""

    values: np.ndarray

    @property
    def estimate(self) -> float:
        """Mean of the trials."""
        return float(self.values.mean())

    @property
    def standard_uncertainty(self) -> float:
        """Standard deviation of the trials."""
        return float(self.values.std(ddof=1))

    def interval(self, coverage: float = 0.95) -> tuple[float, float]:
        """Return the probabilistically symmetric coverage interval."""
        tail = 0.5 * (1.0 - coverage)
        low, high = np.quantile(self.values, [tail, 1.0 - tail])
        return float(low), float(high)

    def shortest(self, coverage: float = 0.95) -> tuple[float, float]:
        """Return the shortest coverage interval (5.3.4)."""
        inside = int(coverage * len(self.values) + 0.5)
        widths = self.values[inside:] - self.values[: len(self.values) - inside]
        start = int(np.argmin(widths))
        return float(self.values[start]), float(self.values[start + inside])


@eqx.filter_jit
def _outputs(model, points):
    return jax.vmap(model)(points)


def monte_carlo(
    model: Model, groups: Sequence[InputGroup], trials: int = 1_000_000, seed: int = 0
) -> MonteCarlo:
    """Propagate the distributions of the inputs through a model.

    Args:
        model: of all inputs in the order of the groups.
        groups: of inputs, independent of each other.
        trials: number of draws.
        seed: of the draws.
    """
    rng = np.random.default_rng(seed)
    points = np.concatenate([_drawn(group, rng, trials) for group in groups], axis=1)
    blocks = range(0, trials, _BLOCK)
    found = [np.asarray(_outputs(model, points[at : at + _BLOCK])) for at in blocks]
    return MonteCarlo(np.sort(np.concatenate(found)))


def _drawn(group: InputGroup, rng: np.random.Generator, count: int) -> np.ndarray:
    """Return draws of the inputs of a group, (count, k)."""
    size = (count, len(group.names))
    if group.law == "normal":
        values, axes = np.linalg.eigh(group.covariance)
        root = axes * np.sqrt(np.maximum(values, 0.0))
        scale = np.ones(count)
        if np.isfinite(group.dof):
            scale = np.sqrt(group.dof / rng.chisquare(group.dof, count))
        return group.estimates + scale[:, None] * (rng.normal(size=size) @ root.T)
    sd = np.sqrt(np.diag(group.covariance))
    return group.estimates + sd / SD_WITHIN[group.law] * _within(group, rng, size)


def _within(group: InputGroup, rng: np.random.Generator, size) -> np.ndarray:
    """Return draws between −1 and 1, or about that where the limits are inexact."""
    if group.law == "arcsine":
        return np.sin(2.0 * np.pi * rng.uniform(size=size))
    if group.law == "triangular":
        return rng.uniform(size=size) - rng.uniform(size=size)
    # A relative uncertainty r of the half width is 1/(2 r²) degrees of freedom
    # (JCGM 100:2008, G.4.2); the middle stays where it is.
    inexact = 1.0 / np.sqrt(2.0 * group.dof)
    half = 1.0 + inexact * rng.uniform(-1.0, 1.0, size)
    return half * rng.uniform(-1.0, 1.0, size)
