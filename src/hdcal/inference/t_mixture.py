"""Mixtures of multivariate t laws, and how they are fitted to weighted places."""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln, softmax

# Tails heavier than a posterior's, which keep weights bounded.
_FREEDOM = 8.0
# Parts that are fitted at most, steps in which they are, and places that each one needs
# for each dimension.
_PARTS, _STEPS, _EACH = 10, 8, 10
# Share of the wide part, and how much farther it goes than all places do.
_WIDE, _FARTHER = 0.2, 1.7
# Least variance of a part, in variances at the mode, and its least share.
_LEAST, _SMALL = 0.01, 0.01


@dataclass(frozen=True)
class TMixture:
    """Some parts with as many degrees of freedom each.

    Attributes:
        share: of each part, shape (k,).
        centre: shape (k, d).
        root: Cholesky factor of the scale matrix, shape (k, d, d).
        freedom: degrees of it.
    """

    share: np.ndarray
    centre: np.ndarray
    root: np.ndarray
    freedom: float = _FREEDOM

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return places, shape (count, d)."""
        part = rng.choice(len(self.share), count, p=self.share)
        normal = rng.standard_normal((count, self.centre.shape[1]))
        tail = np.sqrt(self.freedom / rng.chisquare(self.freedom, count))
        step = np.einsum("nij,nj->ni", self.root[part], normal)
        return self.centre[part] + tail[:, None] * step

    def log_density(self, place: np.ndarray) -> np.ndarray:
        """Return the log density at each place, shape (n, d)."""
        return np.logaddexp.reduce(self.log_parts(place)[0], axis=1)

    def log_parts(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the log density of each part with its share, and squared distances.

        Both of shape (n, k).
        """
        size = place.shape[1]
        square, volume = [], []
        for centre, root in zip(self.centre, self.root, strict=True):
            away = np.linalg.solve(root, (place - centre).T)
            square.append(np.sum(away**2, axis=0))
            volume.append(np.sum(np.log(np.diag(root))))
        distance, half = np.stack(square, axis=1), 0.5 * (self.freedom + size)
        constant = gammaln(half) - gammaln(0.5 * self.freedom)
        constant -= 0.5 * size * np.log(np.pi * self.freedom)
        log_part = np.log(self.share) + constant - np.array(volume)
        return log_part - half * np.log1p(distance / self.freedom), distance


def first_mixture(size: int) -> TMixture:
    """Return laws about the mode: as wide as the posterior is there, and twice so."""
    root = np.stack([np.eye(size), _FARTHER * np.eye(size)])
    return TMixture(np.array([0.5, 0.5]), np.zeros((2, size)), root)


def fitted_mixture(
    place: np.ndarray, share: np.ndarray, rng: np.random.Generator
) -> TMixture:
    """Return the mixture that follows weighted places, and a wide part beside it.

    Args:
        place: shape (n, d).
        share: of each place, shape (n,); sums to 1.
        rng: of the places from which parts start.
    """
    # A few places with most of the weight would be all that parts follow.
    share = np.minimum(share, 1.0 / np.sqrt(len(share)))
    share = share / share.sum()
    middle, whole = _moments(place, share)
    # Each part has as many places as tell its shape.
    worth = 1.0 / np.sum(share**2)
    parts = int(np.clip(worth / (_EACH * place.shape[1]), 1, _PARTS))
    start = place[rng.choice(len(place), parts, p=share)] if parts > 1 else middle[None]
    even = np.full(parts, 1.0 / parts)
    law = TMixture(even, start, np.tile(np.linalg.cholesky(whole), (parts, 1, 1)))
    for _ in range(_STEPS):
        law = _step(law, place, share)
    wide = _FARTHER * np.linalg.cholesky(whole)
    return TMixture(
        np.append((1.0 - _WIDE) * law.share, _WIDE),
        np.vstack([law.centre, middle]),
        np.concatenate([law.root, wide[None]]),
    )


def _step(law: TMixture, place: np.ndarray, share: np.ndarray) -> TMixture:
    """Return a mixture that follows the places better (EM of t laws)."""
    log_part, distance = law.log_parts(place)
    of_part = share[:, None] * softmax(log_part, axis=1)
    near = of_part * (_FREEDOM + place.shape[1]) / (_FREEDOM + distance)
    total = of_part.sum(axis=0)
    parts = []
    for part in np.flatnonzero(total > _SMALL):
        centre = near[:, part] @ place / near[:, part].sum()
        about = (place - centre) * np.sqrt(near[:, part] / total[part])[:, None]
        scatter = about.T @ about + _LEAST * np.eye(place.shape[1])
        parts.append((total[part], centre, np.linalg.cholesky(scatter)))
    shares, centres, roots = map(np.array, zip(*parts, strict=True))
    return TMixture(shares / shares.sum(), centres, roots)


def _moments(place: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    middle = share @ place
    about = (place - middle) * np.sqrt(share)[:, None]
    return middle, about.T @ about + _LEAST * np.eye(place.shape[1])
