"""Effects as lines: within a cell of its amplitude an effect is offset plus slope.

For an effect that is linear in its amplitude one line serves all cells; for others
each cell has the chord of its own, so that large effects need no small ones' slope.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hdcal.evidence.amplitude_grids import (
    FINE,
    SCALE_WEIGHTS,
    SCALES,
    Grid,
    make_grid,
)
from hdcal.evidence.closed_form import Entries
from hdcal.evidence.effect_curves import curves
from hdcal.evidence.prepare import Setting
from hdcal.physics.effect import Effect

# Prior probability that a shape is the library's, and the relative sds by which it
# may differ from it with the probabilities of these.
NO_TOLERANCE = 0.4
TOLERANCES = np.array([0.1, 0.2])
TOLERANCE_WEIGHTS = np.array([0.3, 0.3])
# Doubling the amplitude doubles the curve to this, relative: linear.
_LINEAR = 1e-6


@dataclass(frozen=True)
class Lines:
    """All lines of one effect.

    Attributes:
        grid: the effect and its points.
        linear: whether one line serves all cells.
        values: parameters of each line's upper end, by name, each of shape (g,).
        offsets: contribution at amplitude zero of each line [N], shape (g, n).
        slopes: change per unit of the amplitude, shape (g, n).
        shapes: contribution per unit of the amplitude, shape (g, n).
        reach: contribution at a large physical amplitude, shape (s, n).
    """

    grid: Grid
    linear: bool
    values: dict[str, np.ndarray]
    offsets: np.ndarray
    slopes: np.ndarray
    shapes: np.ndarray
    reach: np.ndarray

    @property
    def name(self) -> str:
        """Name of the effect."""
        return self.grid.effect.name


def draw_lines(effect: type[Effect], setting: Setting) -> Lines:
    """Compute the lines of one effect.

    Args:
        effect: with a single amplitude.
        setting: the case.
    """
    grid = make_grid(effect, setting.priors)
    unit = grid.mean + 2.0 * grid.sd
    at_unit, near = np.moveaxis(_at(grid, np.array([unit, unit / 2.0]), setting), 1, 0)
    scale = np.max(np.abs(at_unit)) or 1.0
    if np.max(np.abs(at_unit - 2.0 * near)) <= _LINEAR * scale:
        slopes = at_unit / unit
        values = _values(grid, np.array([unit]))
        return Lines(grid, True, values, 0.0 * slopes, slopes, slopes, at_unit)
    grid = make_grid(effect, setting.priors, FINE, "cells")
    table = _at(grid, grid.edges, setting)
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
    return Lines(grid, False, values, offsets, chords, shapes, at_unit)


def _values(grid: Grid, amplitudes: np.ndarray) -> dict[str, np.ndarray]:
    values = {n: np.repeat(v, len(amplitudes)) for n, v in grid.shapes.items()}
    return {**values, grid.amplitudes[0]: np.tile(amplitudes, grid.size)}


def _at(grid: Grid, amplitudes: np.ndarray, setting: Setting) -> np.ndarray:
    values = _values(grid, amplitudes)
    found = curves(grid.effect, values, setting.base, setting.records, setting.reading)
    return found.reshape(grid.size, len(amplitudes), -1)


def entries_of(
    lines: Lines, scale: float = 1.0, *, tight: bool = False
) -> dict[str, np.ndarray]:
    """Return the entries of one effect: shape points × cells × scales × tolerances.

    Args:
        lines: of the effect.
        scale: factor on the prior sd of the amplitude.
        tight: without tolerance; cells that share a line and a prior are then one.

    Returns:
        Fields of `Entries`, nodes counted from the effect's first line.
    """
    grid = lines.grid
    low, high = grid.edges[:-1], grid.edges[1:]
    cells = len(low)
    if tight and lines.linear and grid.normal:
        low, high = low[:1], high[-1:]
    scales, weights = SCALES * scale, SCALE_WEIGHTS
    if not grid.centred:
        scales, weights = np.array([1.0]), np.array([1.0])
    tolerances, chances = TOLERANCES, TOLERANCE_WEIGHTS
    if tight:
        tolerances, chances = np.zeros(1), np.ones(1)
    shape, cell, wide, loose = (
        index.ravel()
        for index in np.indices((grid.size, len(low), len(scales), len(tolerances)))
    )
    sd = grid.sd * scales[wide]
    if grid.normal:
        height = np.log((2.0 if grid.one_sided else 1.0) / (sd * np.sqrt(2.0 * np.pi)))
        precision = 1.0 / sd**2
    else:
        height = np.log(np.maximum(grid.mass, 1e-300) / (high - low))[cell]
        precision = np.zeros(len(cell))
    return {
        "node": shape if lines.linear else shape * cells + cell,
        "low": low[cell],
        "high": high[cell],
        "size": np.abs(low + high)[cell] / 2.0,
        "mean": np.full(len(cell), grid.mean),
        "precision": precision,
        "log_height": height,
        "log_weight": np.log(weights[wide] * chances[loose] / grid.size),
        "tolerance": tolerances[loose],
    }


def join(parts: Sequence[dict[str, np.ndarray]], starts: Sequence[int]) -> Entries:
    """Return the entries of several effects as one.

    Args:
        parts: entries of each.
        starts: index of each one's first line among all.
    """
    moved = [{**p, "node": p["node"] + s} for p, s in zip(parts, starts, strict=True)]
    return Entries(
        **{name: np.concatenate([p[name] for p in moved]) for name in moved[0]}
    )
