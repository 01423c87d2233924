"""What is known of the inputs of a model: groups of estimates with their laws.

Groups are independent of each other; inputs of one group have a covariance.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Law = Literal["normal", "rectangular", "triangular", "arcsine"]
# Standard uncertainty of a law within −1 … 1 (JCGM 101:2008, 6.4).
SD_WITHIN = {
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
    variance = np.array([[(0.5 * (high - low) * SD_WITHIN[law]) ** 2]])
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


def independent(covariance: np.ndarray, sizes: Sequence[int], chance: float = 0.0):
    """Return blocks of inputs that are independent, and how the inputs depend on them.

    V = A D Aᵀ with A block triangular: each block is what those before it leave open.
    Where a correlation is left to chance, V lacks what that correlation brings.

    Args:
        covariance: V of the inputs, (m, m).
        sizes: of the blocks, in their order.
        chance: a block whose largest correlation with a later one is this, or less,
            is taken for independent of them.

    Returns:
        A, and the diagonal blocks of D.
    """
    left, depend = covariance.copy(), np.eye(len(covariance))
    blocks, start = [], 0
    for size in sizes:
        own, rest = slice(start, start + size), slice(start + size, None)
        blocks.append(left[own, own].copy())
        sd = np.sqrt(np.maximum(np.diag(left), 0.0))
        # Parts of a tie would not cancel: it is whole or none.
        if np.any(np.abs(left[rest, own]) > chance * np.outer(sd[rest], sd[own])):
            tie = left[rest, own] @ np.linalg.pinv(left[own, own], hermitian=True)
            depend[rest, own] = tie
            left[rest, rest] -= tie @ left[own, rest]
        start += size
    return depend, blocks
