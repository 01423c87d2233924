"""The laws that points of importance sampling are drawn from, and learn from them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import softmax

from hdcal.inference.importance import TMixture

# Degrees of freedom of the laws, and how much wider than their shape they are.
_FREE, _SPREAD = 5.0, 1.3
# Points per dimension that a shape rests on, at least.
_RESTS_ON = 20.0
# The power of weights is searched for between 1 and ten to this one.
_LEAST_POWER = -12.0


@dataclass(frozen=True)
class SamplingLaws:
    """Student's t about the posterior, and about where the limit is exceeded.

    Attributes:
        counts: coordinates of a point that they are of; the others, scores on which
            nothing depends, stay standard normal.
        places: centre and covariance of each.
    """

    counts: np.ndarray
    places: tuple[tuple[np.ndarray, np.ndarray], ...]

    def drawn(self, count: int, rng) -> tuple[np.ndarray, np.ndarray]:
        """Return points about both places alike, and the log density of their law.

        The density is up to a factor.

        Args:
            count: of the points.
            rng: source of randomness.
        """
        centres, shapes = zip(*self.places, strict=True)
        roots = [_SPREAD * np.linalg.cholesky(_wide(shape)) for shape in shapes]
        even = np.full(len(centres), 1.0 / len(centres))
        law = TMixture(even, np.stack(centres), np.stack(roots), _FREE)
        points = rng.normal(size=(count, len(self.counts)))
        log_law = -0.5 * np.sum(points[:, ~self.counts] ** 2, axis=1)
        points[:, self.counts] = law.draw(count, rng)
        return points, log_law + law.log_density(points[:, self.counts])

    def reshaped(
        self, points: np.ndarray, log_weights: Sequence[np.ndarray]
    ) -> "SamplingLaws":
        """Return laws of the mean and covariance that weighted points have.

        Args:
            points: of a round.
            log_weights: of the points, for each of the laws.
        """
        points = points[:, self.counts]
        least = _RESTS_ON * points.shape[1]
        places = []
        for old, log_weight in zip(self.places, log_weights, strict=True):
            weight = _tempered(log_weight, least)
            if weight is None:
                places.append(old)
                continue
            centre = weight @ points
            off = points - centre
            places.append((centre, (weight * off.T) @ off))
        return replace(self, places=tuple(places))


def _wide(shape: np.ndarray) -> np.ndarray:
    """Return a covariance without directions in which it is next to nothing."""
    strength, axes = np.linalg.eigh(0.5 * (shape + shape.T))
    return (axes * np.maximum(strength, 1e-8 * strength.max())) @ axes.T


def _tempered(log_weight: np.ndarray, least: float) -> np.ndarray | None:
    """Return weights, to a power at which they are worth so many points at least.

    None where hardly any point has a weight.
    """
    if np.count_nonzero(np.isfinite(log_weight)) < 2.0 * least:
        return None

    def powered(exponent: float) -> np.ndarray:
        return softmax(10.0**exponent * log_weight)

    def excess(exponent: float) -> float:
        return 1.0 / np.sum(powered(exponent) ** 2) - least

    if excess(0.0) >= 0.0:
        return powered(0.0)
    return powered(root_scalar(excess, bracket=(_LEAST_POWER, 0.0)).root)
