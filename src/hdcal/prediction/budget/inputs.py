"""What is known of the inputs of a model: groups of estimates with their laws.

Groups are independent of each other; inputs of one group have a covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Law = Literal["normal", "rectangular", "triangular", "arcsine"]
# Standard uncertainty of a law within −1 … 1 (JCGM 101:2008, 6.4).
_SD_WITHIN = {
    "rectangular": 1.0 / np.sqrt(3.0),
    "triangular": 1.0 / np.sqrt(6.0),
    "arcsine": 1.0 / np.sqrt(2.0),
}


@dataclass(frozen=True)
class InputGroup:
    """Inputs that are known together.

    Attributes:
        names: of the inputs.
        estimates: of them, (k,).
        covariance: standard uncertainties and what ties them, (k, k).
        law: of a single input; several are normal.
        dof: degrees of freedom of the covariance. A normal law with finitely many is a
            Student t, whose scale the covariance is; limits with finitely many are
            known inexactly themselves (JCGM 101:2008, 6.4.3).
    """

    names: tuple[str, ...]
    estimates: np.ndarray
    covariance: np.ndarray
    law: Law = "normal"
    dof: float = np.inf

    @property
    def label(self) -> str:
        """The law in words."""
        if self.law == "normal" and np.isfinite(self.dof):
            return f"Student t, {self.dof:.3g} degrees of freedom"
        return self.law

    def sample(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Return draws of the inputs, (count, k)."""
        size = (count, len(self.names))
        if self.law == "normal":
            values, axes = np.linalg.eigh(self.covariance)
            root = axes * np.sqrt(np.maximum(values, 0.0))
            scale = np.ones(count)
            if np.isfinite(self.dof):
                scale = np.sqrt(self.dof / rng.chisquare(self.dof, count))
            return self.estimates + scale[:, None] * (rng.normal(size=size) @ root.T)
        sd = np.sqrt(np.diag(self.covariance))
        return self.estimates + sd / _SD_WITHIN[self.law] * self._within(rng, size)

    def _within(self, rng: np.random.Generator, size) -> np.ndarray:
        """Return draws between −1 and 1, or about that where the limits are inexact."""
        if self.law == "arcsine":
            return np.sin(2.0 * np.pi * rng.uniform(size=size))
        if self.law == "triangular":
            return rng.uniform(size=size) - rng.uniform(size=size)
        # A relative uncertainty r of the half width is 1/(2 r²) degrees of freedom
        # (JCGM 100:2008, G.4.2); the middle stays where it is.
        inexact = 1.0 / np.sqrt(2.0 * self.dof)
        half = 1.0 + inexact * rng.uniform(-1.0, 1.0, size)
        return half * rng.uniform(-1.0, 1.0, size)


def one_input(
    name: str, estimate: float, standard_uncertainty: float, dof: float = np.inf
) -> InputGroup:
    """Return one normal input; with finitely many degrees of freedom a Student t."""
    variance = np.array([[standard_uncertainty**2]])
    return InputGroup((name,), np.array([estimate], float), variance, "normal", dof)


def limited_input(
    name: str,
    low: float,
    high: float,
    law: Law = "rectangular",
    dof: float = np.inf,
) -> InputGroup:
    """Return one input of which limits are known.

    Args:
        name: of the input.
        low: lower limit.
        high: upper limit.
        law: rectangular, triangular or arcsine.
        dof: of the standard uncertainty, where the limits are known inexactly.
    """
    variance = np.array([[(0.5 * (high - low) * _SD_WITHIN[law]) ** 2]])
    middle = np.array([0.5 * (low + high)])
    return InputGroup((name,), middle, variance, law, dof)


def joined_inputs(
    names: Sequence[str], estimates, covariance, dof: float = np.inf
) -> InputGroup:
    """Return inputs that were estimated together, with their covariance."""
    means, ties = np.asarray(estimates, float), np.asarray(covariance, float)
    return InputGroup(tuple(names), means, ties, "normal", dof)


def scatter_law(variances: np.ndarray) -> tuple[float, float]:
    """Return scale and degrees of freedom of normal scatter of unknown variance.

    The Student t with the same second and fourth moment: for draws ν s²/χ²_ν it is
    that of ν degrees of freedom and scale s.

    Args:
        variances: in every draw.
    """
    mean = float(np.mean(variances))
    spread = float(np.var(variances)) / mean**2 if mean > 0.0 else 0.0
    if spread < 1e-6:
        return float(np.sqrt(mean)), np.inf
    dof = 4.0 + 2.0 / spread
    return float(np.sqrt(mean * (dof - 2.0) / dof)), dof


def independent(covariance: np.ndarray, sizes: Sequence[int]):
    """Return blocks of inputs that are independent, and how the inputs depend on them.

    V = A D Aᵀ with A block triangular: each block is what those before it leave open.

    Args:
        covariance: V of the inputs, (m, m).
        sizes: of the blocks, in their order.

    Returns:
        A, and the diagonal blocks of D.
    """
    left, depend = covariance.copy(), np.eye(len(covariance))
    blocks, start = [], 0
    for size in sizes:
        own, rest = slice(start, start + size), slice(start + size, None)
        blocks.append(left[own, own].copy())
        tie = left[rest, own] @ np.linalg.pinv(left[own, own], hermitian=True)
        depend[rest, own] = tie
        left[rest, rest] -= tie @ left[own, rest]
        start += size
    return depend, blocks
