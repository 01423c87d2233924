"""Structure outside the library, as kernels over the covariates of the rows.

A kernel is a space: smooth functions of one covariate, labels, products of two of them,
or a Matérn-½ process over the order of the rows.
"""

from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from hdcal.evidence.components import (
    MOST_COLUMNS,
    STEPS,
    Components,
    Space,
    principal,
)
from hdcal.evidence.covariates import cosines, half_cycle_rows
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.row_features import half_cycles, place_in_run, scale_to_unit

# Cosines along one covariate, along each of two, and most labels of a kernel.
_ALONE, _TOGETHER, _LABELS = 16, 4, 24
# A kernel is dropped of which the base model leaves less than this, relative rms.
_LEAST = 1e-3
# Kernels with more similar covariances than this are one (cosine of their angle), and
# one of whose variance a single effect spans more than this share is none.
_SAME, _SPANNED = 0.97, 0.9
# Length of the Matérn-½ process as a share of a half cycle.
_LENGTH = 0.5


class _Features(NamedTuple):
    """Functions (k, n) of each covariate, smoothest first, and indicators of labels."""

    smooth: dict[str, np.ndarray]
    labels: dict[str, np.ndarray]


def _features(problem: LinearProblem) -> _Features:
    return _Features(_smooth(problem), _labels(problem))


def _smooth(problem: LinearProblem) -> dict[str, np.ndarray]:
    records, known = problem.records, problem.records.known
    found = {"deformation": cosines(scale_to_unit(records.deformation), _ALONE)}
    if "temperature" in known and np.ptp(records.temperature) > 0.05:
        warm = cosines(scale_to_unit(records.temperature), _ALONE)
        found["temperature"] = warm[: _levels(records.temperature, 1)]
    if "rates" in known:
        speed = np.asarray(records.rate) / np.max(np.abs(records.rate))
        found["rate"] = cosines(speed, _ALONE)[: _levels(speed, 2)]
    found["order in run"] = cosines(place_in_run(records.run), _ALONE)
    if len(np.unique(records.run)) > 1:
        found["order"] = cosines(np.linspace(-1.0, 1.0, len(problem.y)), _ALONE)
    if "angle" in known:
        turns = np.arange(1, _ALONE // 2 + 1)[:, None] * np.asarray(records.angle)
        waves = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        found["angle"] = waves.reshape(-1, len(problem.y))
    return found


def _levels(values, digits: int) -> int:
    """Return how many functions so many different values can tell apart."""
    return max(1, len(np.unique(np.round(values, digits))) - 1)


def _labels(problem: LinearProblem) -> dict[str, np.ndarray]:
    records, found = problem.records, {}
    if "unloading" in records.known:
        found["direction"] = np.asarray(records.sense, float)[None]
    halves = half_cycles(records)
    # Two half cycles are two directions; as many as runs are runs.
    fewest = {"half cycle": max(2, len(np.unique(records.run)))}
    labels = {"run": records.run, "specimen": records.specimen, "half cycle": halves}
    for name, label in labels.items():
        members = np.unique(label)
        if fewest.get(name, 1) < len(members) <= _LABELS:
            found[name] = (np.asarray(label) == members[:, None]).astype(float)
    return found


def _weighted(table: Float[np.ndarray, "k n"], count: int) -> Float[np.ndarray, "j n"]:
    """Return the first functions, with prior sds that fall with their number."""
    return table[:count] / np.arange(1, min(count, len(table)) + 1)[:, None]


def _matern(problem: LinearProblem) -> Float[np.ndarray, "k n"]:
    """Return a Matérn-½ process over the order of the rows, by its spectral density.

    Readings that agree with their neighbours over half a half cycle are structure:
    neither outliers nor noise.
    """
    count = len(problem.y)
    length = _LENGTH * half_cycle_rows(problem.records) / count
    waves = cosines(np.linspace(-1.0, 1.0, count), MOST_COLUMNS)
    frequency = np.pi * np.arange(1, MOST_COLUMNS + 1)
    return waves / np.sqrt(1.0 + (length * frequency) ** 2)[:, None]


def _tables(problem: LinearProblem) -> list[Float[np.ndarray, "k n"]]:
    """Return the columns of each kernel: covariates, slopes over them, products."""
    smooth, labels = _features(problem)
    alone = {n: _weighted(table, _ALONE) for n, table in smooth.items()} | labels
    deformation = np.asarray(problem.records.deformation)
    slope = deformation / np.max(np.abs(deformation))
    tables = [*alone.values()]
    tables += [slope * t[:_LABELS] for n, t in alone.items() if n != "deformation"]
    low = {n: _weighted(table, _TOGETHER) for n, table in smooth.items()} | labels
    for one, other in combinations(low, 2):
        if not (one in labels and other in labels):
            product = low[one][:, None] * low[other][None]
            tables.append(product.reshape(-1, len(problem.y)))
    return [*tables, _matern(problem)]


def kernels(problem: LinearProblem, effects: Components, owner: int) -> list[Space]:
    """Return the kernels that the base model leaves and no single effect spans.

    Args:
        problem: the case.
        effects: of the library.
        owner: index of the remainder among the components.
    """
    visible = []
    for table in _tables(problem):
        left = problem.project(table)
        size = np.sqrt(np.sum(np.mean(left**2, axis=1)))
        if size > _LEAST * np.sqrt(np.sum(np.mean(table**2, axis=1))):
            visible.append(principal(left / size))
    stacked = np.concatenate(visible)
    starts = np.cumsum([0, *map(len, visible)])[:-1]
    whole = np.add.reduceat(np.sum(stacked**2, axis=1), starts)
    spanned = _spanned(problem, effects, stacked, starts)
    return [
        remainder_space(problem, owner, visible[index])
        for index in _different(stacked, starts)
        if spanned[index] < _SPANNED * whole[index]
    ]


def _different(stacked, starts) -> list[int]:
    """Return the kernels whose covariances differ from those of kernels before them."""
    square = (stacked @ stacked.T) ** 2
    gram = np.add.reduceat(np.add.reduceat(square, starts, axis=0), starts, axis=1)
    size, kept = np.sqrt(np.diag(gram)), []
    for index in range(len(starts)):
        if np.all(gram[index, kept] <= _SAME * size[index] * size[kept]):
            kept.append(index)
    return kept


def _spanned(problem: LinearProblem, effects: Components, stacked, starts):
    """Return the most variance of each kernel that one effect spans."""
    curves = problem.project(effects.atoms.slope)
    size = np.linalg.norm(curves, axis=1)
    curves = (curves[size > 0.0] / size[size > 0.0, None]).T
    along = np.add.reduceat((stacked @ curves) ** 2, starts, axis=0)
    most = [along.max(axis=1, initial=0.0)]
    for space in effects.spaces:
        left = problem.project(space.columns)
        _, strength, axes = np.linalg.svd(left, full_matrices=False)
        axes = axes[strength > 1e-8 * strength[0]]
        inside = np.sum((stacked @ axes.T) ** 2, axis=1)
        most.append(np.add.reduceat(inside, starts))
    return np.max(most, axis=0)


def remainder_space(
    problem: LinearProblem, owner: int, columns, choices: int = 1
) -> Space:
    """Return a space of the remainder, whose size is unknown.

    Args:
        problem: the case.
        owner: index of the remainder among the components.
        columns: of unit rms together, shape (j, n).
        choices: number of spaces that this one was chosen from.
    """
    sd = float(problem.priors["gap_sd"].numbers[-1])
    log_weight = np.full(len(STEPS), -np.log(len(STEPS)) - np.log(choices))
    return Space(owner, columns, sd * STEPS, log_weight)
