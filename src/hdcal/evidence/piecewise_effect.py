"""Effects as piecewise linear functions of their amplitude.

For an effect that is linear in its amplitude one piece, offset plus slope, serves all
cells of the amplitude; for others each cell has the chord of its own, so that large
effects are not judged by the slope of small ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.evidence.closed_form import AmplitudeCells
from hdcal.evidence.effect_curves import effect_curves
from hdcal.evidence.parameter_grid import (
    FINE,
    SCALE_WEIGHTS,
    SCALES,
    ParameterGrid,
    make_grid,
)
from hdcal.evidence.prepare import PreparedCase
from hdcal.physics.effect import Effect

# Prior probability that a shape is the library's, and the relative sds by which it
# may differ from it with the probabilities of these.
NO_TOLERANCE = 0.4
TOLERANCES = np.array([0.1, 0.2])
TOLERANCE_WEIGHTS = np.array([0.3, 0.3])
# Doubling the amplitude doubles the curve to this, relative: linear.
_LINEAR = 1e-6


@dataclass(frozen=True)
class PiecewiseEffect:
    """All pieces of one effect: of each shape point one, or one for each cell.

    Attributes:
        grid: the effect and its points.
        linear: whether one piece serves all cells.
        values: parameters of each piece's upper end, by name, each of shape (g,).
        offsets: contribution at amplitude zero of each piece [N], shape (g, n).
        slopes: change per unit of the amplitude, shape (g, n).
        shapes: contribution per unit of the amplitude, shape (g, n).
        large: contribution at a large physical amplitude, shape (s, n).
    """

    grid: ParameterGrid
    linear: bool
    values: dict[str, np.ndarray]
    offsets: np.ndarray
    slopes: np.ndarray
    shapes: np.ndarray
    large: np.ndarray

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.grid.effect.name


def piecewise_effect(effect: type[Effect], case: PreparedCase) -> PiecewiseEffect:
    """Compute the pieces of one effect.

    Args:
        effect: with a single amplitude.
        case: on whose rows it acts.
    """
    grid = make_grid(effect, case.priors)
    unit = grid.mean + 2.0 * grid.sd
    at_unit, near = np.moveaxis(_at(grid, np.array([unit, unit / 2.0]), case), 1, 0)
    scale = np.max(np.abs(at_unit)) or 1.0
    if np.max(np.abs(at_unit - 2.0 * near)) <= _LINEAR * scale:
        slopes = at_unit / unit
        values = _values(grid, np.array([unit]))
        return PiecewiseEffect(
            grid, True, values, 0.0 * slopes, slopes, slopes, at_unit
        )
    grid = make_grid(effect, case.priors, FINE, "cells")
    table = _at(grid, grid.edges, case)
    chords = np.diff(table, axis=1) / np.diff(grid.edges)[None, :, None]
    offsets = table[:, :-1] - chords * grid.edges[None, :-1, None]
    outer = np.where(np.abs(grid.edges[1:]) > np.abs(grid.edges[:-1]), 1, 0)
    end = np.arange(len(outer)) + outer
    shapes = table[:, end] / grid.edges[end][None, :, None]
    rows = table.shape[-1]
    offsets, chords, shapes = (
        part.reshape(-1, rows) for part in (offsets, chords, shapes)
    )
    values = _values(grid, grid.edges[end])
    return PiecewiseEffect(grid, False, values, offsets, chords, shapes, at_unit)


def _values(grid: ParameterGrid, amplitudes: np.ndarray) -> dict[str, np.ndarray]:
    values = {n: np.repeat(v, len(amplitudes)) for n, v in grid.shapes.items()}
    return {**values, grid.amplitudes[0]: np.tile(amplitudes, grid.size)}


def _at(grid: ParameterGrid, amplitudes: np.ndarray, case: PreparedCase) -> np.ndarray:
    values = _values(grid, amplitudes)
    found = effect_curves(grid.effect, values, case.base, case.records, case.reading)
    return found.reshape(grid.size, len(amplitudes), -1)


def amplitude_cells(
    effect: PiecewiseEffect, scale: float = 1.0, *, exact: bool = False
) -> AmplitudeCells:
    """Return the cells of one effect: shape points × cells × scales × tolerances.

    Args:
        effect: in pieces.
        scale: factor on the prior sd of the amplitude.
        exact: without tolerance of the shape; cells that share a piece and a prior are
            then one.

    Returns:
        Cells, pieces counted from the effect's first.
    """
    grid = effect.grid
    low, high = grid.edges[:-1], grid.edges[1:]
    cells = len(low)
    if exact and effect.linear and grid.normal:
        low, high = low[:1], high[-1:]
    scales, weights = SCALES * scale, SCALE_WEIGHTS
    if not grid.centred:
        scales, weights = np.array([1.0]), np.array([1.0])
    tolerances, chances = TOLERANCES, TOLERANCE_WEIGHTS
    if exact:
        tolerances, chances = np.zeros(1), np.ones(1)
    shape, cell, width, loose = (
        index.ravel()
        for index in np.indices((grid.size, len(low), len(scales), len(tolerances)))
    )
    sd = grid.sd * scales[width]
    if grid.normal:
        height = np.log((2.0 if grid.one_sided else 1.0) / (sd * np.sqrt(2.0 * np.pi)))
        precision = 1.0 / sd**2
    else:
        height = np.log(np.maximum(grid.mass, 1e-300) / (high - low))[cell]
        precision = np.zeros(len(cell))
    return AmplitudeCells(
        piece=shape if effect.linear else shape * cells + cell,
        low=low[cell],
        high=high[cell],
        size=np.abs(low + high)[cell] / 2.0,
        mean=np.full(len(cell), grid.mean),
        precision=precision,
        log_height=height,
        log_weight=np.log(weights[width] * chances[loose] / grid.size),
        tolerance=tolerances[loose],
    )


def join_cells(
    parts: Sequence[AmplitudeCells], starts: Sequence[int]
) -> AmplitudeCells:
    """Return the cells of several effects as one.

    Args:
        parts: cells of each.
        starts: index of each one's first piece among all.
    """
    moved = [
        part._replace(piece=part.piece + start)
        for part, start in zip(parts, starts, strict=True)
    ]
    return AmplitudeCells(*map(np.concatenate, zip(*moved, strict=True)))
