"""One family-wise test of the base model: are its residuals only noise?

In a Gaussian linear model the law of residual over its own sd is known exactly, so
that the simulated band holds for all cells at once, whatever their correlation.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from hdcal.data.records import Array
from hdcal.evidence.prepare import Setting
from hdcal.evidence.whitened_rows import whiten

# How the false-alarm rate is divided between declared directions of the mean, members
# of a label all together, stretches and periods, and the noise.
_SHARES = {"largest": 0.65, "between": 0.1, "local": 0.1, "noise": 0.15}
_MOST_NUMBERS = 2_000_000
_DRAWS = (400, 2000)


@dataclass(frozen=True)
class Gate:
    """Outcome of the test.

    Attributes:
        p_value: family-wise.
        mean_p_value: of the mean alone, whatever the noise looks like.
        z: of each direction.
        bias: mean residual along each cell [N].
        half_width: of the simultaneous 95 % band of the bias [N].
        residual: reading minus fitted base model [N], shape (n,).
        noise_sd: of a reading, base model only [N].
        statistics: by name.
    """

    p_value: float
    mean_p_value: float
    z: Float[Array, " m"]
    bias: Float[Array, " m"]
    half_width: Float[Array, " m"]
    residual: Float[Array, " n"]
    noise_sd: float
    statistics: dict[str, float]


def _p_value(chance: dict[str, float], parts) -> float:
    """Return the family-wise p-value over some parts of the test."""
    whole = sum(_SHARES[name] for name in parts)
    return min(1.0, *(chance[name] * whole / _SHARES[name] for name in parts))


def _design(setting: Setting, correlation: float) -> tuple[np.ndarray, np.ndarray]:
    """Return whitened base columns with prior rows below, orthonormal, and raw ones.

    Slope and offset are free; what temperature does is held by its prior.
    """
    rows = setting.rows
    white = np.asarray(whiten(rows, rows.base, correlation))
    held = np.sqrt(np.asarray(rows.precision))
    below = np.diag(np.where(np.arange(len(held)) < 2, 0.0, held))
    stacked = np.vstack([white, below])
    left, strength, right = np.linalg.svd(stacked, full_matrices=False)
    kept = strength > 1e-10 * strength[0]
    return left[:, kept], (right[kept].T / strength[kept])


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
        part = cells[start:end][::-1] * root
        # Backwards y_i = √(1−ρ²) c_i + ρ y_(i+1); a run's first row is not shrunk.
        solved = lfilter([1.0], [1.0, -correlation], part, axis=0)[::-1]
        first = cells[start]
        if end - start > 1:
            first = first + correlation * solved[1:2][0] / root
        solved = np.concatenate([first[None], solved[1:]])
        out[start:end] = solved
    return out


def gate(
    setting: Setting,
    correlation: float,
    cells: Float[Array, "n c"],
    curves: Float[Array, "n k"],
    labels: Float[Array, "n l"],
    local: Float[Array, "n d"],
    rng: np.random.Generator,
    *,
    draws: int | None = None,
) -> Gate:
    """Test the base model against cells, curves and shapes of the noise.

    Args:
        setting: the case.
        correlation: AR(1) coefficient of the noise.
        cells: 1 in a cell's rows, 0 elsewhere.
        curves: other directions that were declared before the data, [N per unit].
        labels: indices of members whose means are tested together.
        local: directions of stretches and periods [N per unit].
        rng: source of randomness.
        draws: of pure noise; by default as many as memory lets.
    """
    rows = setting.rows
    size = len(rows.reading)
    basis, solve = _design(setting, correlation)
    white = np.asarray(whiten(rows, rows.reading, correlation))
    padded = np.append(white, np.zeros(basis.shape[0] - size))
    error = (padded - basis @ (basis.T @ padded))[:size]
    along = np.column_stack(
        [
            pull_back(
                np.asarray(rows.before), rows.weight, correlation, np.asarray(cells)
            ),
            np.asarray(whiten(rows, curves, correlation)),
        ]
    )
    top = basis[:size]
    unit, length = _unit(along, top)
    white_local, _ = _unit(np.asarray(whiten(rows, local, correlation)), top)
    freedom = size - np.sum(top**2)
    force = setting.base.stiffness * np.asarray(setting.records.deformation)
    between = _between(np.asarray(labels, int))
    directions = (unit, between, white_local, freedom, force)
    observed = _statistics(error[None], *directions)
    draws = draws or int(np.clip(_MOST_NUMBERS // size, *_DRAWS))
    null = _null(size, basis, directions, draws, rng)
    chance = {
        name: float((1 + np.sum(null[name] >= value[0])) / (1 + draws))
        for name, value in observed.items()
        if name != "z"
    }
    chance["noise"] = 2.0 * min(chance["spread"], chance["tails"])
    spread = float(np.sqrt(np.sum(error**2) / freedom))
    counts = np.maximum(cells.sum(axis=0), 1.0)
    z = observed["z"][0]
    step = spread * length[: cells.shape[1]] / counts
    critical = float(np.quantile(null["largest"], 0.95))
    fitted = rows.base @ (solve @ (basis.T @ padded))
    return Gate(
        _p_value(chance, _SHARES),
        _p_value(chance, ("largest", "between", "local")),
        z,
        z[: cells.shape[1]] * step,
        critical * step,
        np.asarray(rows.reading) - fitted,
        spread,
        {
            "largest": float(observed["largest"][0]),
            "critical": critical,
            **{f"p_{name}": value for name, value in chance.items()},
        },
    )


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


def _statistics(
    error, unit, between, local, freedom: float, force
) -> dict[str, np.ndarray]:
    """Return the statistics of each row of errors, all free of the noise sd."""
    scaled = error / np.sqrt(np.sum(error**2, axis=1, keepdims=True) / freedom)
    z = scaled @ unit
    square = force**2 - np.mean(force**2)
    return {
        "z": z,
        "largest": np.max(np.abs(z), axis=1, initial=0.0),
        "local": np.max(np.abs(scaled @ local), axis=1, initial=0.0),
        "between": np.sum((scaled @ between) ** 2, axis=1),
        "spread": np.abs(scaled**2 @ square),
        "tails": np.sum(scaled**4, axis=1),
    }


def _null(size, basis, directions, draws: int, rng) -> dict[str, np.ndarray]:
    """Return the statistics of pure noise."""
    parts, block = [], max(1, _MOST_NUMBERS // basis.shape[0])
    while draws > 0:
        count = min(block, draws)
        noise = rng.standard_normal((count, basis.shape[0]))
        error = (noise - (noise @ basis) @ basis.T)[:, :size]
        found = _statistics(error, *directions)
        parts.append({k: v for k, v in found.items() if k != "z"})
        draws -= count
    return {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
