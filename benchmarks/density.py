"""One log density for every sampler: hdcal's own, and the same written by hand.

The case is XB1-100-80 with the rounding left out, so that its rows are compressed;
the coordinates are hdcal's: unconstrained, then whitened by the Laplace fit.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.children import CASE

# Order of the flattened unconstrained position.
NAMES = ("E0", "_KE0", "_centre_force", "alpha", "deformation_offset", "sigma")
SITES = {"_KE0": "K", "_centre_force": "force_offset"}
CHAINS, WARMUP, DRAWS = 4, 1000, 1000


@dataclass(frozen=True)
class Numbers:
    """All that the hand-written density needs, as plain arrays."""

    centre: np.ndarray
    factor: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    rows: np.ndarray
    count: np.ndarray
    unit_stiffness: np.ndarray
    middle: np.ndarray

    def save(self, path: Path) -> None:
        np.savez(path, **vars(self))

    @classmethod
    def load(cls, path: Path) -> "Numbers":
        with np.load(path) as stored:
            return cls(**stored)


def log_density(e, numbers: Numbers, xp):
    """Compute it with NumPy (any leading axes) or PyTensor, whichever `xp` is."""
    x = numbers.centre + e @ numbers.factor.T
    u, v, force, alpha, zero, w = (x[..., i] for i in range(6))
    slope = xp.exp(v) * float(numbers.unit_stiffness)
    modulus, log_K, offset = xp.exp(u), v - u, force - slope * float(numbers.middle)
    parts = (modulus, log_K, offset, alpha, zero, w)
    # The Jacobian of log E0; those of the lognormals cancel.
    total = u
    for value, mean, sd in zip(parts, numbers.mean, numbers.sd, strict=True):
        total = total - 0.5 * ((value - mean) / sd) ** 2
        total = total - (0.5 * np.log(2.0 * np.pi) + np.log(sd))
    c = (slope, -slope * alpha, offset - slope * zero, slope * alpha * zero)
    squares = 0.0
    for row in numbers.rows:
        left = row[4] - sum(row[j] * c[j] for j in range(4) if row[j] != 0.0)
        squares = squares + left**2
    log_volume = float(numbers.count) * (w + 0.5 * np.log(2.0 * np.pi))
    return total - log_volume - 0.5 * squares * xp.exp(-2.0 * w)


def make_problem():
    """Return hdcal's problem: the XB1-100-80 case, neither rounded nor correlated."""
    from hdcal import read_case
    from hdcal.data.priors import Prior, effect_priors
    from hdcal.inference.force_model.problem import build_problem

    case = read_case(CASE)
    alone = case.gear.scale_priors | {"noise_correlation": Prior("fixed", (0.0,))}
    gear = replace(case.gear, force_resolution=0.0, scale_priors=alone)
    case = replace(case, gear=gear)
    return build_problem(case, effect_priors())


def make_numbers() -> tuple[Numbers, float]:
    """Return the numbers, and how far the two densities differ at random points."""
    import jax

    from hdcal.inference import laplace

    problem = make_problem()
    whitening = laplace.fit(problem)
    laws = [problem.priors[SITES.get(name, name)] for name in NAMES]
    centre = np.array([whitening.centre[name] for name in sorted(whitening.centre)])
    numbers = Numbers(
        centre=centre,
        factor=np.asarray(whitening.factor),
        mean=np.array([_mean(law) for law in laws]),
        sd=np.array([law.numbers[1] for law in laws]),
        rows=problem.blocks.factor[0],
        count=problem.blocks.count[0],
        unit_stiffness=np.asarray(problem.unit_stiffness),
        middle=np.asarray(problem.centre),
    )
    if tuple(sorted(whitening.centre)) != NAMES:
        raise RuntimeError(f"other coordinates: {sorted(whitening.centre)}")
    points = np.random.default_rng(1).normal(0.0, 2.0, (200, 6))
    theirs = jax.vmap(lambda e: -laplace.potential(problem, whitening.position(e)))
    gap = np.asarray(theirs(points)) - log_density(points, numbers, np)
    return numbers, float(np.abs(gap).max())


def _mean(law) -> float:
    return np.log(law.numbers[0]) if law.family == "lognormal" else law.numbers[0]


def named(standard: np.ndarray, numbers: Numbers) -> dict[str, np.ndarray]:
    """Return the parameters of standard draws (chain, draw, 6), logs for positive."""
    x = numbers.centre + standard @ numbers.factor.T
    values = {name: x[..., i] for i, name in enumerate(NAMES)}
    return values | {"K": x[..., 1] - x[..., 0]}


def least_ess(values: dict[str, np.ndarray]) -> float:
    """Return the smallest bulk ESS; ranks do not mind logarithms."""
    from arviz_stats.base import array_stats

    sizes = [array_stats.ess(v, chain_axis=0, draw_axis=1) for v in values.values()]
    return float(min(map(float, sizes)))
