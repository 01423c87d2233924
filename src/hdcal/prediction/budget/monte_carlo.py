"""Propagation of distributions by Monte Carlo, and the check of a linear budget by it.

JCGM 101:2008, clauses 7 and 8.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import numpy as np

from hdcal.prediction.budget.inputs import InputGroup
from hdcal.prediction.budget.linear import Model

# Trials of a model that are computed at a time.
_BLOCK = 1 << 17
# Digits of a standard uncertainty that count.
_DIGITS = 2


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
    points = np.concatenate([group.sample(rng, trials) for group in groups], axis=1)
    blocks = range(0, trials, _BLOCK)
    found = [np.asarray(_outputs(model, points[at : at + _BLOCK])) for at in blocks]
    return MonteCarlo(np.sort(np.concatenate(found)))


def numerical_tolerance(standard_uncertainty: float, digits: int = _DIGITS) -> float:
    """Return half a unit in the last of the digits of an uncertainty that count.

    JCGM 101:2008, 7.9.2: for u = c·10^l with c of so many digits it is ½·10^l.
    """
    if not standard_uncertainty > 0.0:
        return 0.0
    # Rounded first: 0.0996 has the digits 10 and not 99.
    rounded = float(f"{standard_uncertainty:.{digits - 1}e}")
    place = int(np.floor(np.log10(rounded) + 1e-9))
    return 0.5 * 10.0 ** (place - digits + 1)


@dataclass(frozen=True)
class LinearCheck:
    """A linear coverage interval beside that of Monte Carlo.

    Attributes:
        tolerance: how far the ends may differ.
        low: how far the lower ends do.
        high: how far the upper ends do.
    """

    tolerance: float
    low: float
    high: float

    @property
    def valid(self) -> bool:
        """Whether the linear budget stands."""
        return max(self.low, self.high) <= self.tolerance


def check_linear(
    linear: tuple[float, float],
    reference: tuple[float, float],
    standard_uncertainty: float,
) -> LinearCheck:
    """Compare the coverage interval of a linear budget with that of Monte Carlo.

    Args:
        linear: interval of the linear budget.
        reference: of Monte Carlo, of the same kind and coverage.
        standard_uncertainty: whose digits say how far they may differ.
    """
    low, high = (abs(a - b) for a, b in zip(linear, reference, strict=True))
    return LinearCheck(numerical_tolerance(standard_uncertainty), low, high)
