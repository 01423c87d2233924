"""One family-wise test of the base model: are its residuals only noise?

In a Gaussian linear model the law of residual over its own sd is known exactly, so
that the simulated band holds for all cells at once, whatever their correlation.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import solve_banded

from hdcal.evidence.linear_rows import LinearRows, whiten
from hdcal.evidence.prepare import PreparedCase

# How the false-alarm rate is divided between declared directions of the mean, members
# of a label all together, stretches and periods, and the noise.
_SHARES = {"largest": 0.65, "between": 0.1, "local": 0.1, "noise": 0.15}
_MOST_NUMBERS = 2_000_000
_DRAWS = (400, 2000)


@dataclass(frozen=True)
class Directions:
    """Where a gap is looked for, declared before the data are seen; by column.

    Attributes:
        cells: 1 in a cell's rows, 0 elsewhere.
        curves: other directions of the mean [N per unit].
        labels: indices of members whose means are tested together.
        local: directions of stretches and periods [N per unit].
    """

    cells: Float[np.ndarray, "n c"]
    curves: Float[np.ndarray, "n k"]
    labels: Int[np.ndarray, "n l"]
    local: Float[np.ndarray, "n d"]


@dataclass(frozen=True)
class ResidualTest:
    """Outcome of the test.

    Attributes:
        p_value: family-wise.
        mean_p_value: of the mean alone, whatever the noise looks like.
        z: of each cell, then of each curve.
        bias: mean residual along each cell [N].
        half_width: of the simultaneous 95 % band of the bias [N].
        residual: reading minus fitted base model [N], shape (n,).
        noise_sd: of a reading, base model only [N].
        statistics: by name.
    """

    p_value: float
    mean_p_value: float
    z: Float[np.ndarray, " m"]
    bias: Float[np.ndarray, " c"]
    half_width: Float[np.ndarray, " c"]
    residual: Float[np.ndarray, " n"]
    noise_sd: float
    statistics: dict[str, float]


@dataclass(frozen=True)
class _Statistics:
    """What the statistics of a whitened residual are computed with.

    Attributes:
        unit: whitened cells and curves, each over what the base leaves of it.
        local: the same of local directions.
        between: columns whose squared products sum to what lies between members.
        square: squared force about its mean [N²], shape (n,).
        freedom: rows less what the base model uses up.
    """

    unit: np.ndarray
    local: np.ndarray
    between: np.ndarray
    square: np.ndarray
    freedom: float

    def of(self, error: np.ndarray) -> dict[str, np.ndarray]:
        """Return the statistics of each row of errors, all free of the noise sd."""
        size = np.sqrt(np.sum(error**2, axis=1, keepdims=True) / self.freedom)
        scaled = error / size
        square = scaled**2
        z = scaled @ self.unit
        return {
            "z": z,
            "largest": np.max(np.abs(z), axis=1, initial=0.0),
            "local": np.max(np.abs(scaled @ self.local), axis=1, initial=0.0),
            "between": np.sum((scaled @ self.between) ** 2, axis=1),
            "spread": np.abs(square @ self.square),
            "tails": np.sum(square**2, axis=1),
        }


def residual_test(
    case: PreparedCase,
    correlation: float,
    directions: Directions,
    rng: np.random.Generator,
    *,
    draws: int | None = None,
) -> ResidualTest:
    """Test the base model against cells, curves and shapes of the noise.

    Args:
        case: whose residuals are tested.
        correlation: AR(1) coefficient of the noise.
        directions: where a gap is looked for.
        rng: source of randomness.
        draws: of pure noise; by default as many as memory allows.
    """
    rows = case.rows
    size = len(rows.reading)
    basis, solve = _base_directions(rows, correlation)
    white = whiten(rows, rows.reading, correlation)
    padded = np.append(white, np.zeros(basis.shape[0] - size))
    error = (padded - basis @ (basis.T @ padded))[:size]
    statistics, length = _prepare_statistics(case, correlation, directions, basis)
    observed = statistics.of(error[None])
    draws = draws or int(np.clip(_MOST_NUMBERS // size, *_DRAWS))
    null = _null(size, basis, statistics, draws, rng)
    chance = {
        name: float((1 + np.sum(null[name] >= value[0])) / (1 + draws))
        for name, value in observed.items()
        if name != "z"
    }
    chance["noise"] = 2.0 * min(chance["spread"], chance["tails"])
    spread = float(np.sqrt(np.sum(error**2) / statistics.freedom))
    counts = np.maximum(directions.cells.sum(axis=0), 1.0)
    step = spread * length[: len(counts)] / counts
    critical = float(np.quantile(null["largest"], 0.95))
    fitted = rows.base @ (solve @ (basis.T @ padded))
    z = observed["z"][0]
    return ResidualTest(
        _p_value(chance, _SHARES),
        _p_value(chance, ("largest", "between", "local")),
        z,
        z[: len(counts)] * step,
        critical * step,
        rows.reading - fitted,
        spread,
        {"largest": float(observed["largest"][0]), "critical": critical}
        | {f"p_{name}": value for name, value in chance.items()},
    )


def _p_value(chance: dict[str, float], parts) -> float:
    """Return the family-wise p-value over some parts of the test."""
    whole = sum(_SHARES[name] for name in parts)
    return min(1.0, *(chance[name] * whole / _SHARES[name] for name in parts))


def _base_directions(
    rows: LinearRows, correlation: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return whitened base columns with prior rows below, orthonormal, and raw ones.

    Slope and offset are free; what temperature does is held by its prior.
    """
    white = whiten(rows, rows.base, correlation)
    held = np.sqrt(rows.precision)
    below = np.diag(np.where(np.arange(len(held)) < 2, 0.0, held))
    stacked = np.vstack([white, below])
    left, strength, right = np.linalg.svd(stacked, full_matrices=False)
    kept = strength > 1e-10 * strength[0]
    return left[:, kept], (right[kept].T / strength[kept])


def _prepare_statistics(
    case: PreparedCase, correlation: float, directions: Directions, basis: np.ndarray
) -> tuple[_Statistics, np.ndarray]:
    """Return what the statistics need, and what the base leaves of each direction."""
    rows, top = case.rows, basis[: len(case.rows.reading)]
    along = np.column_stack(
        [
            pull_back(rows.before, rows.weight, correlation, directions.cells),
            whiten(rows, directions.curves, correlation),
        ]
    )
    unit, length = _unit(along, top)
    local, _ = _unit(whiten(rows, directions.local, correlation), top)
    force = case.base.stiffness * np.asarray(case.records.deformation)
    square = np.asarray(force**2 - np.mean(force**2))
    between = _between(np.asarray(directions.labels, int))
    freedom = float(len(top) - np.sum(top**2))
    return _Statistics(unit, local, between, square, freedom), length


def pull_back(
    before: np.ndarray, weight, correlation: float, cells: np.ndarray
) -> np.ndarray:
    """Return W⁻ᵀ c for each column c: the transposed inverse of the whitening."""
    starts = np.flatnonzero(before < 0)
    ends = np.append(starts[1:], len(before))
    cells = cells / np.asarray(weight)[:, None]
    out = np.empty_like(cells)
    root = np.sqrt(1.0 - correlation**2)
    for start, end in zip(starts, ends, strict=True):
        # y_i − ρ y_(i+1) = √(1−ρ²) c_i; a run's first row is not scaled.
        bands = np.outer([-correlation, 1.0], np.ones(end - start))
        solved = solve_banded((0, 1), bands, root * cells[start:end])
        first = cells[start]
        if end - start > 1:
            first = first + correlation * solved[1:2][0] / root
        solved = np.concatenate([first[None], solved[1:]])
        out[start:end] = solved
    return out


def _between(labels: np.ndarray) -> np.ndarray:
    """Return columns whose squared products sum to what lies between members."""
    found = [np.zeros((len(labels), 0))]
    for label in labels.T:
        inside = (label[:, None] == np.unique(label)).astype(float)
        found.append(inside / np.sqrt(inside.sum(axis=0)) / np.sqrt(inside.shape[1]))
    return np.concatenate(found, axis=1)


def _unit(along: np.ndarray, top: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return directions over the length that the base leaves of them, and lengths."""
    seen = np.sum(along**2, axis=0) - np.sum((top.T @ along) ** 2, axis=0)
    length = np.sqrt(np.maximum(seen, 0.0))
    keep = length > 1e-6 * np.linalg.norm(along, axis=0)
    return np.where(keep, along / np.where(keep, length, 1.0), 0.0), length


def _null(
    size: int, basis: np.ndarray, statistics: _Statistics, draws: int, rng
) -> dict[str, np.ndarray]:
    """Return the statistics of pure noise."""
    parts, block = [], max(1, _MOST_NUMBERS // basis.shape[0])
    while draws > 0:
        count = min(block, draws)
        noise = rng.standard_normal((count, basis.shape[0]))
        error = (noise - (noise @ basis) @ basis.T)[:, :size]
        found = statistics.of(error)
        parts.append({k: v for k, v in found.items() if k != "z"})
        draws -= count
    return {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
