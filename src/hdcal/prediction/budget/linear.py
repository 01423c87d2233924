"""The law of propagation of uncertainty, with covariances and degrees of freedom.

JCGM 100:2008, 5.1.2, 5.2.2 and G.4: the model is replaced by its tangent at the
estimates, its derivatives are exact (JAX). What that costs is told by the comparison
with Monte Carlo of JCGM 101:2008, clause 8.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import jax
import numpy as np
from jax.tree_util import Partial, all_leaves
from scipy.special import ndtri, stdtrit

from hdcal.exported import jit
from hdcal.prediction.budget.inputs import InputGroup

# Digits of a standard uncertainty that count.
_DIGITS = 2
# A function of all inputs in their order, shape (n,), that returns the output. A
# pytree, such as `jax.tree_util.Partial`, is compiled once for all its values.
Model: TypeAlias = Callable[..., Any]


@dataclass(frozen=True)
class LinearBudget:
    """An estimate, its uncertainty, and what each input brings.

    Attributes:
        names: of the inputs.
        estimate: of the output.
        sensitivities: derivatives of the output by the inputs, (n,).
        standard_uncertainties: of the inputs, (n,).
        variances: what each input brings to the variance of the output, its part of
            the covariances included, (n,). They sum to that variance.
        dof: effective degrees of freedom (Welch–Satterthwaite).
    """

    names: tuple[str, ...]
    estimate: float
    sensitivities: np.ndarray
    standard_uncertainties: np.ndarray
    variances: np.ndarray
    dof: float

    @property
    def standard_uncertainty(self) -> float:
        """Combined standard uncertainty of the output."""
        return float(np.sqrt(max(self.variances.sum(), 0.0)))

    @property
    def shares(self) -> np.ndarray:
        """Share of each input in the variance, (n,); they sum to 1."""
        total = self.variances.sum()
        return self.variances / total if total > 0.0 else np.zeros(len(self.names))

    def coverage_factor(self, coverage: float = 0.95) -> float:
        """Return k of a coverage probability, interpolated between whole dof."""
        return coverage_factor(self.dof, coverage)

    def interval(self, coverage: float = 0.95) -> tuple[float, float]:
        """Return the coverage interval, estimate ∓ k·u."""
        expanded = self.coverage_factor(coverage) * self.standard_uncertainty
        return self.estimate - expanded, self.estimate + expanded


def coverage_factor(dof: float, coverage: float = 0.95) -> float:
    """Return the two-sided quantile of Student's t."""
    share = 0.5 * (1.0 + coverage)
    return float(stdtrit(dof, share) if dof < 1e9 else ndtri(share))


@jit
def _tangent(model, at):
    return jax.value_and_grad(model)(at)


def linear_budget(model: Model, groups: Sequence[InputGroup]) -> LinearBudget:
    """Return the linear budget of a model's output.

    Args:
        model: of all inputs in the order of the groups.
        groups: of inputs, independent of each other.
    """
    at = np.concatenate([group.estimates for group in groups])
    # A function that is no pytree is one then.
    tree = Partial(model) if all_leaves([model]) else model
    value, slopes = _tangent(tree, at)
    slopes = np.asarray(slopes)
    names = tuple(name for group in groups for name in group.names)
    parts, sds, start = [], [], 0
    for group in groups:
        own = slopes[start : start + len(group.names)]
        start += len(group.names)
        parts.append(own * (group.covariance @ own))
        sds.append(np.sqrt(np.diag(group.covariance)))
    totals = np.array([part.sum() for part in parts])
    dof = effective_dof(totals, np.array([group.dof for group in groups]))
    each = np.concatenate(sds), np.concatenate(parts)
    return LinearBudget(names, float(value), slopes, *each, dof)


def effective_dof(variances: np.ndarray, dof: np.ndarray) -> float:
    """Return effective degrees of freedom of a sum of independent variances.

    ν = (Σ uᵢ²)² / Σ uᵢ⁴/νᵢ, JCGM 100:2008, (G.2b).
    """
    uncertain = np.sum(variances**2 / dof)
    return float(variances.sum() ** 2 / uncertain) if uncertain > 0.0 else np.inf


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
