"""Quantiles of the force over the draws, for many designs."""

from dataclasses import replace

import numpy as np

from hdcal.design.design_draws import DesignDraws
from hdcal.prediction.engine.gear_forces import gear_forces

# Forces held at a time [numbers]: 16 MB.
_BLOCK = 2_000_000


def force_quantiles(
    draws: DesignDraws,
    factor: np.ndarray,
    deformation: np.ndarray,
    temperature: np.ndarray,
    shares: np.ndarray,
) -> np.ndarray:
    """Return quantiles of the force over the draws for every design.

    Args:
        draws: n of them.
        factor: stiffness over the tested gear's [-], shape (d,).
        deformation: radial, of the gear [mm], shape (d,).
        temperature: [°C], shape (d,).
        shares: probabilities, shape (q,).

    Returns:
        Forces [N], shape (q, d).
    """
    if any(effect.stage == "force" for effect in draws.problem.effects):
        return general_quantiles(draws, factor, deformation, temperature, shares)
    # A positive factor does not change the ranks of draws: the quantiles of the tested
    # gear at each place hold for all sizes, and where the force is proportional to the
    # deformation those at 1 mm, of each sense of loading, hold for all deformations.
    line = draws.within_tested(deformation) & is_linear(draws)
    found = np.empty((len(shares), len(factor)))
    for rows, at, scale, basis in (
        (
            line,
            np.sign(deformation),
            np.abs(deformation),
            replace(draws, untested=None),
        ),
        (~line, deformation, np.ones_like(deformation), draws),
    ):
        if rows.any():
            places = np.stack([at, temperature])[:, rows]
            (way, levels), which = np.unique(places, axis=1, return_inverse=True)
            ones = np.ones_like(levels)
            unit = general_quantiles(basis, ones, way, levels, shares)
            found[:, rows] = unit[:, which] * (factor * scale)[rows]
    return found


def is_linear(draws: DesignDraws) -> bool:
    """Tell whether the model's force is proportional to stiffness and deformation."""
    has_effects = any(effect.stage == "force" for effect in draws.problem.effects)
    return not has_effects and draws.problem.discrepancy is None


def general_quantiles(
    draws: DesignDraws,
    factor: np.ndarray,
    deformation: np.ndarray,
    temperature: np.ndarray,
    shares: np.ndarray,
) -> np.ndarray:
    """Evaluate every draw for every design, a block of designs at a time.

    Arguments and result are those of `force_quantiles`.
    """
    size = min(max(1, _BLOCK // draws.size), len(factor))
    values, found = dict(draws.values), []
    for start in range(0, len(factor), size):
        rows = slice(start, start + size)
        at, warm, scale = (
            _filled(a[rows], size) for a in (deformation, temperature, factor)
        )
        where = at, warm, scale, draws.untested
        forces = np.asarray(gear_forces(draws.problem, values, *where))
        found.append(np.quantile(forces[: len(factor[rows])], shares, axis=1))
    return np.concatenate(found, axis=1)


def _filled(values: np.ndarray, size: int) -> np.ndarray:
    # Blocks of equal length are compiled once.
    return np.concatenate([values, np.full(size - len(values), values[0])])
