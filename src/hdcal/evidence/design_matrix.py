"""A hypothesis at its most probable point: what it adds to the base, linearised."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hdcal.data.records import Array
from hdcal.evidence.effect_lines import Lines
from hdcal.evidence.single_evidence import Singles
from hdcal.evidence.subspaces import Subspaces
from hdcal.evidence.whitened_rows import Rows, whiten


@dataclass(frozen=True)
class Design:
    """Contribution offset + columns · a with a ~ N(mean, sd²).

    Attributes:
        offset: at amplitude zero of the line [N], shape (n,).
        columns: per unit of each amplitude [N], shape (k, n).
        mean: of the prior of each amplitude.
        sd: of the prior of each amplitude.
        values: parameters of the point by `effect.parameter`; amplitudes left out.
    """

    offset: Float[Array, " n"]
    columns: Float[Array, "k n"]
    mean: Float[Array, " k"]
    sd: Float[Array, " k"]
    values: dict[str, float]


def line_design(singles: Singles, lines: Lines, index: int) -> Design:
    """Return the most probable line of an effect."""
    cells = singles.cells[0]
    own = np.flatnonzero(cells.owner == index)
    weight = np.logaddexp.reduce(cells.log_evidence[:, own], axis=0)
    entry = own[int(np.argmax(weight))]
    node = int(cells.entries.node[entry]) - int(singles.starts[index])
    e = cells.entries
    return design_at(lines, node, float(e.mean[entry]), float(e.precision[entry]))


def design_at(lines: Lines, node: int, mean: float, precision: float) -> Design:
    """Return one line of an effect.

    Args:
        lines: of the effect.
        node: index of the line.
        mean: of the amplitude's prior.
        precision: of the amplitude's prior; 0 where it is flat.
    """
    values = {
        f"{lines.name}.{name}": float(table[node])
        for name, table in lines.values.items()
        if name not in lines.grid.amplitudes
    }
    return Design(
        lines.offsets[node],
        lines.slopes[node][None],
        np.array([mean]),
        1.0 / np.sqrt(np.array([precision or 1e-12])),
        values,
    )


def subspace_design(spaces: Subspaces, name: str) -> Design:
    """Return a subspace at its most probable shape and scale."""
    shape, scale = spaces.likeliest(name)
    columns = spaces.columns[spaces.of(name)[shape]]
    columns = columns[np.any(columns != 0.0, axis=1)]
    count = len(columns)
    nothing = np.zeros(columns.shape[1])
    return Design(nothing, columns, np.zeros(count), np.full(count, scale), {})


def join_designs(designs: list[Design], rows: int) -> Design:
    """Return several contributions as one; none is a design without columns."""
    empty = Design(np.zeros(rows), np.zeros((0, rows)), np.zeros(0), np.zeros(0), {})
    every = [empty, *designs]
    return Design(
        np.sum([d.offset for d in every], axis=0),
        np.concatenate([d.columns for d in every]),
        np.concatenate([d.mean for d in every]),
        np.concatenate([d.sd for d in every]),
        {k: v for d in every for k, v in d.values.items()},
    )


@dataclass(frozen=True)
class Fit:
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
    rows: Rows,
    design: Design,
    noise_sd: float,
    correlation: float,
    kept: np.ndarray | None = None,
) -> Fit:
    """Fit base and design to some rows.

    Args:
        rows: the data.
        design: what the hypothesis adds.
        noise_sd: σ [N].
        correlation: AR(1) coefficient of the noise.
        kept: which rows count, shape (n,); others have no weight. Their neighbours
            keep the whitening of the whole run.
    """
    columns = np.column_stack([np.asarray(rows.base), design.columns.T])
    prior = np.concatenate([np.asarray(rows.precision), (noise_sd / design.sd) ** 2])
    mean = np.concatenate([np.zeros(rows.base.shape[1]), design.mean])
    target = np.asarray(rows.reading) - design.offset
    white = np.asarray(whiten(rows, np.column_stack([target, columns]), correlation))
    if kept is not None:
        white = white[kept]
    target, seen = white[:, 0], white[:, 1:]
    precision = seen.T @ seen + np.diag(prior)
    covariance = noise_sd**2 * np.linalg.inv(precision)
    centre = np.linalg.solve(precision, seen.T @ target + prior * mean)
    return Fit(centre, covariance, columns, np.asarray(design.offset))
