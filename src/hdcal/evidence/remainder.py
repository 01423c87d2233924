"""Structure outside the library: kernels over covariates, and local structure.

A kernel is a space: smooth functions of one covariate, labels, products of two of them,
or a Matérn-½ process over the order of the rows. Local structure is one stretch of rows
or one period: of each family of directions the likeliest member enters, and its prior
is divided by the size of the family.
"""

from itertools import combinations

import numpy as np
from jaxtyping import Float

from hdcal.evidence.components import Components
from hdcal.evidence.items import MOST_COLUMNS, STEPS, Space, principal
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.parameter_grid import prior_rms
from hdcal.evidence.row_features import (
    cosines,
    half_cycle_rows,
    half_cycles,
    place_in_run,
    scale_to_unit,
)

# Pairs of directions, shape (f, 2, n).
Family = Float[np.ndarray, "f 2 n"]

# Cosines along one covariate, along each of two, and most labels of a kernel.
_ALONE, _TOGETHER, _LABELS = 16, 4, 24
# A kernel is dropped of which the base model leaves less than this, relative rms.
_LEAST = 1e-3
# Kernels with more similar covariances than this are one (cosine of their angle), and
# one of whose variance a single effect spans more than this share is none.
_SAME, _SPANNED = 0.97, 0.9
# Length of the Matérn-½ process as a share of a half cycle.
_LENGTH = 0.5
# Shortest stretch as a share of all rows; most periods, by rows and by the clock.
_FINEST, _MOST_PERIODS, _MOST_BY_TIME = 1.0 / 64.0, 96, 384
# Rows are uneven in time where the longest step is so many median ones; pauses count
# as at most so many.
_UNEVEN, _LONGEST_PAUSE = 1.5, 30.0


def _smooth(problem: LinearProblem) -> dict[str, np.ndarray]:
    """Return functions (k, n) of each covariate, smoothest first."""
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
    """Return the number of functions that so many different values determine."""
    return max(1, len(np.unique(np.round(values, digits))) - 1)


def _labels(problem: LinearProblem) -> dict[str, np.ndarray]:
    """Return indicators (k, n) of labels."""
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
    smooth, labels = _smooth(problem), _labels(problem)
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
    """Return the kernels that the base model leaves and no single effect spans."""
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
    """Return a space of unknown size of columns of rms one, among many choices."""
    sd = prior_rms(problem.priors["gap_sd"])
    log_weight = np.full(len(STEPS), -np.log(len(STEPS)) - np.log(choices))
    return Space(owner, columns, sd * STEPS, log_weight)


def local_families(problem: LinearProblem) -> list[Family]:
    """Return families of directions: stretches in two orders, periods, by the clock."""
    count = len(problem.y)
    deformation = np.asarray(problem.records.deformation)
    slope = deformation / deformation[np.argmax(np.abs(deformation))]
    found = []
    for path in (np.arange(count), np.argsort(slope, kind="stable")):
        inside = _stretches(count)
        table = np.zeros_like(inside)
        table[:, path] = inside
        # A stretch may be off by a force or by a part of the stiffness.
        found.append(np.stack([table, table * slope], axis=1))
    found.append(_waves(np.arange(count) / count, min(count // 2, _MOST_PERIODS)))
    found += _by_the_clock(problem)
    return [family for family in found if len(family)]


def _by_the_clock(problem: LinearProblem) -> list[Family]:
    """Return periods in time, where rows are uneven in it."""
    records = problem.records
    step = np.maximum(np.diff(np.asarray(records.time, float)), 0.0)
    step[np.diff(np.asarray(records.run)) != 0] = 0.0
    moves = step[step > 0.0]
    if "time" not in records.known or not len(moves):
        return []
    usual = float(np.median(moves))
    if np.max(moves) < _UNEVEN * usual:
        return []
    step = np.minimum(step, _LONGEST_PAUSE * usual)
    place = np.concatenate([[0.0], np.cumsum(step)]) / np.sum(step)
    return [_waves(place, min(int(0.5 * np.sum(step) / usual), _MOST_BY_TIME))]


def _stretches(count: int) -> Float[np.ndarray, "f n"]:
    """Return indicators of stretches that overlap by half, each half as long."""
    length, found = count // 2, [np.zeros((0, count))]
    while length >= max(2, count * _FINEST):
        starts = np.arange(0, count - length + 1, max(length // 2, 1))
        place = np.arange(count) - starts[:, None]
        found.append(((place >= 0) & (place < length)).astype(float))
        length //= 2
    return np.concatenate(found)


def _waves(place: Float[np.ndarray, " n"], most: int) -> Family:
    turns = 2.0 * np.pi * np.arange(2, most + 1)[:, None] * place
    return np.stack([np.cos(turns), np.sin(turns)], axis=1)


def likeliest_members(
    problem: LinearProblem, families: list[Family], owner: int
) -> list[Space]:
    """Return the member of each family that the readings show most."""
    error = problem.project(problem.y)
    half = np.linalg.solve(problem.root.T, problem.X.T).T
    found = []
    for family in families:
        # One large product of matrices, not many small ones.
        along = family.reshape(-1, len(error)) @ np.column_stack([half, error])
        along = along.reshape(len(family), 2, -1)
        inside = along[..., :-1]
        gram = family @ np.swapaxes(family, 1, 2) - inside @ np.swapaxes(inside, 1, 2)
        (a, b), (_, d) = np.moveaxis(gram, 0, -1)
        ridge = 1e-9 * np.max(a + d)
        a, d = a + ridge, d + ridge
        one, two = along[..., -1].T
        # Decrease of the squared error by the best combination of both directions.
        gain = (d * one**2 - 2.0 * b * one * two + a * two**2) / (a * d - b**2)
        best = problem.project(family[int(np.argmax(gain))])
        size = np.sqrt(np.sum(np.mean(best**2, axis=1)))
        if size > 0.0:
            space = remainder_space(problem, owner, best / size, len(family))
            found.append(space)
    return found
