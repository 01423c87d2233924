"""A case whose posterior is known: with E₀, α and ω₀ fixed, F = s ω + b + noise.

It is linear in (K, b), whose normal priors are conjugate: given σ the posterior is
normal in closed form, and its evidence gives that of σ by quadrature on a line.
"""

from dataclasses import dataclass

import numpy as np
from rigs import make_case, make_gear, make_records
from scipy import stats

from hdcal.data.case import Case
from hdcal.data.priors import Prior
from hdcal.physics.theory import ring

MODULUS = 207e3
K, OFFSET = (2.5, 0.5), (0.0, 5.0)
SIGMA = Prior("lognormal", (0.5, 1.2))
_NODES = 4001


@dataclass(frozen=True)
class Known:
    """The posterior of (K, b) given each σ of a line, and the weight of each.

    Attributes:
        sigma: [N], shape (n,).
        weight: shape (n,), sum 1.
        mean: of K and b, shape (n, 2).
        covariance: shape (n, 2, 2).
    """

    sigma: np.ndarray
    weight: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray


def conjugate_case(deformation, force, sigma: Prior = SIGMA) -> Case:
    """Return readings [N] at deformations [mm], independent of each other."""
    gear = make_gear(
        K=Prior("normal", K),
        E0=Prior("fixed", (MODULUS,)),
        alpha=Prior("fixed", (3e-4,)),
        deformation_offset=Prior("fixed", (0.0,)),
        force_offset=Prior("normal", OFFSET),
        sigma=sigma,
        noise_correlation=Prior("fixed", (0.0,)),
    )
    return make_case(make_records(deformation, force), gear)


def unit_stiffness(case: Case) -> float:
    """Return the stiffness that K multiplies [N/mm]."""
    return float(ring(case.gear.geometry, MODULUS))


def known_posterior(case: Case) -> Known:
    """Return the posterior of a conjugate case by quadrature over log σ."""
    records, rows = case.records, len(case.records.force)
    slope = unit_stiffness(case) * records.deformation
    design = np.column_stack([slope, np.ones(rows)])
    gram, cross = design.T @ design, design.T @ records.force
    square = records.force @ records.force
    precision0 = np.diag([K[1] ** -2, OFFSET[1] ** -2])
    mean0 = np.array([K[0], OFFSET[0]])
    rest = records.force - design @ np.linalg.solve(gram, cross)
    grid, prior = _line(case, np.sqrt(rest @ rest / rows), rows)
    found = []
    for log_sigma in grid:
        variance = np.exp(2.0 * log_sigma)
        precision = precision0 + gram / variance
        covariance = np.linalg.inv(precision)
        mean = covariance @ (precision0 @ mean0 + cross / variance)
        fit = square / variance + mean0 @ precision0 @ mean0 - mean @ precision @ mean
        evidence = -0.5 * (fit + np.linalg.slogdet(precision)[1]) - rows * log_sigma
        found.append((evidence, mean, covariance))
    evidence, mean, covariance = map(np.array, zip(*found, strict=True))
    weight = np.exp(evidence + prior - np.max(evidence + prior))
    return Known(np.exp(grid), weight / weight.sum(), mean, covariance)


def _line(case: Case, guess: float, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Return log σ to go along, and the log density of its prior there."""
    sigma = case.gear.priors["sigma"]
    if sigma.family == "fixed":
        return np.log(np.array(sigma.numbers, float)), np.zeros(1)
    width = max(0.7 / np.sqrt(rows), 1e-4)
    grid = np.log(guess) + np.linspace(-6.0, 20.0, _NODES) * width
    median, log_sd = sigma.numbers
    return grid, stats.norm.logpdf(grid, np.log(median), log_sd)
