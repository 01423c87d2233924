"""What a hypothesis adds to the base model, linearised, and its fit to some rows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hdcal.evidence.linear_rows import LinearRows, whiten


@dataclass(frozen=True)
class DesignMatrix:
    """Contribution offset + columns · a with a ~ N(mean, sd²).

    Attributes:
        offset: at amplitude zero [N], shape (n,).
        columns: per unit of each amplitude [N], shape (k, n).
        mean: of the prior of each amplitude.
        sd: of the prior of each amplitude.
        values: parameters of the point by `effect.parameter`; amplitudes left out.
    """

    offset: Float[np.ndarray, " n"]
    columns: Float[np.ndarray, "k n"]
    mean: Float[np.ndarray, " k"]
    sd: Float[np.ndarray, " k"]
    values: dict[str, float]


def join_designs(designs: Sequence[DesignMatrix], rows: int) -> DesignMatrix:
    """Return several contributions as one; none is a design without columns."""
    nothing = np.zeros(0)
    empty = DesignMatrix(np.zeros(rows), np.zeros((0, rows)), nothing, nothing, {})
    every = [empty, *designs]
    return DesignMatrix(
        np.sum([d.offset for d in every], axis=0),
        np.concatenate([d.columns for d in every]),
        np.concatenate([d.mean for d in every]),
        np.concatenate([d.sd for d in every]),
        {k: v for d in every for k, v in d.values.items()},
    )


@dataclass(frozen=True)
class DesignFit:
    """Gaussian posterior of base coefficients and amplitudes given a design.

    Attributes:
        mean: of base coefficients, then amplitudes.
        covariance: the same order.
        columns: whose combination is the mean reading, shape (n, p + k).
        offset: of the reading [N], shape (n,).
    """

    mean: np.ndarray
    covariance: np.ndarray
    columns: np.ndarray
    offset: np.ndarray

    def predict(self) -> np.ndarray:
        """Return the mean reading less the base's prior mean [N]."""
        return self.offset + self.columns @ self.mean

    def contribution(self, base_width: int) -> np.ndarray:
        """Return what the effects alone add [N]."""
        return self.offset + self.columns[:, base_width:] @ self.mean[base_width:]


def fit_design(
    rows: LinearRows,
    design: DesignMatrix,
    noise_sd: float,
    correlation: float,
    kept: np.ndarray | None = None,
) -> DesignFit:
    """Fit base and design to some rows.

    Args:
        rows: the data.
        design: what the hypothesis adds.
        noise_sd: σ [N].
        correlation: AR(1) coefficient of the noise.
        kept: which rows count, shape (n,); others have no weight. Their neighbours
            keep the whitening of the whole run.
    """
    columns = np.column_stack([rows.base, design.columns.T])
    prior = np.concatenate([rows.precision, (noise_sd / design.sd) ** 2])
    mean = np.concatenate([np.zeros(rows.base.shape[1]), design.mean])
    target = rows.reading - design.offset
    white = whiten(rows, np.column_stack([target, columns]), correlation)
    if kept is not None:
        white = white[kept]
    target, seen = white[:, 0], white[:, 1:]
    precision = seen.T @ seen + np.diag(prior)
    covariance = noise_sd**2 * np.linalg.inv(precision)
    centre = np.linalg.solve(precision, seen.T @ target + prior * mean)
    return DesignFit(centre, covariance, columns, design.offset)
