"""Effects as atoms and spaces: pieces in which their contribution is linear.

An atom is one curve, offset + slope · a, with a prior of the amplitude a that is normal
or flat in an interval. An effect that is linear in its amplitude has an atom for each
point of its shape parameters and width of its prior; a nonlinear one has an atom, the
chord, for each shape point and amplitude cell. A space is a set of columns of which all
coefficients have one prior sd: effects with several amplitudes, members that differ,
and kernels of the remainder.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import erf

from hdcal.data.records import Records
from hdcal.evidence.effect_curves import curves_on_runs, effect_curves
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.parameter_grid import (
    FINE,
    SCALE_WEIGHTS,
    SCALES,
    ParameterGrid,
    make_grid,
)
from hdcal.physics.effect import Effect
from hdcal.physics.effects.scatter import Scatter, scores

# Factors on the prior sd of a space whose size is unknown, and its most columns.
STEPS = 2.0 ** np.arange(-5.0, 5.0)
MOST_COLUMNS = 24
# Relative deviation from proportionality from which an effect is nonlinear.
_NONLINEAR = 1e-6


class Amplitudes(NamedTuple):
    """Priors of the amplitudes of atoms, each of shape (m,).

    The density is exp(log_height − precision · (a − mean)² / 2) from low to high.

    Attributes:
        low: least amplitude.
        high: largest amplitude.
        mean: centre of the normal.
        precision: of the normal; 0 where the density is flat.
        log_height: log density at the centre.
    """

    low: Float[np.ndarray, " m"]
    high: Float[np.ndarray, " m"]
    mean: Float[np.ndarray, " m"]
    precision: Float[np.ndarray, " m"]
    log_height: Float[np.ndarray, " m"]


class Atoms(NamedTuple):
    """Atoms of all effects.

    Attributes:
        owner: index of the effect, shape (m,).
        shape: index of the point of its shape parameters, shape (m,).
        curve: index of its curve, shape (m,).
        amplitude: priors of the amplitudes.
        log_weight: log prior probability of each atom of its effect, shape (m,).
        offset: contribution of each curve at amplitude 0 [N], shape (c, n).
        slope: contribution per unit of the amplitude [N], shape (c, n).
    """

    owner: Int[np.ndarray, " m"]
    shape: Int[np.ndarray, " m"]
    curve: Int[np.ndarray, " m"]
    amplitude: Amplitudes
    log_weight: Float[np.ndarray, " m"]
    offset: Float[np.ndarray, "c n"]
    slope: Float[np.ndarray, "c n"]

    def pick(self, index: Int[np.ndarray, " k"]) -> "Atoms":
        """Return some of the atoms, each with a curve of its own."""
        own, curve = np.arange(len(index)), self.curve[index]
        return Atoms(
            self.owner[index],
            self.shape[index],
            own,
            Amplitudes(*(column[index] for column in self.amplitude)),
            self.log_weight[index],
            self.offset[curve],
            self.slope[curve],
        )

    def bounded(self, size: Float[np.ndarray, " m"]) -> Float[np.ndarray, " m"]:
        """Return amplitudes moved to the nearest possible ones."""
        return np.clip(size, self.amplitude.low, self.amplitude.high)


class Space(NamedTuple):
    """Columns whose coefficients have one prior sd, on a grid of it.

    Attributes:
        owner: index of the component.
        columns: contribution per unit of each coefficient [N], shape (j, n).
        scale: values of the prior sd, shape (t,).
        log_weight: log prior probability of each, shape (t,).
        shape: index of the point of the shape parameters of an effect with several
            amplitudes; −1 of the others.
    """

    owner: int
    columns: Float[np.ndarray, "j n"]
    scale: Float[np.ndarray, " t"]
    log_weight: Float[np.ndarray, " t"]
    shape: int = -1


@dataclass(frozen=True)
class Components:
    """Effects of a library on the mean reading.

    Attributes:
        names: of the effects.
        atoms: of those with one amplitude.
        spaces: of the others.
    """

    names: tuple[str, ...]
    atoms: Atoms
    spaces: tuple[Space, ...]


def components(
    effects: Mapping[str, type[Effect]], problem: LinearProblem
) -> Components:
    """Return atoms and spaces of the effects on the mean reading."""
    names = tuple(n for n, effect in effects.items() if effect.stage != "noise")
    none = np.zeros(0)
    nothing = Amplitudes(none, none, none, none, none)
    rows = np.zeros((0, len(problem.y)))
    index = none.astype(int)
    atoms = [Atoms(index, index, index, nothing, none, rows, rows)]
    spaces: list[Space] = []
    for owner, effect in enumerate(effects[name] for name in names):
        if issubclass(effect, Scatter):
            spaces.append(_members(owner, effect, problem))
            continue
        grid = make_grid(effect, problem.priors, FINE)
        if len(grid.amplitudes) > 1:
            spaces += _several_amplitudes(owner, effect, problem)
        else:
            found = _one_amplitude(owner, grid, problem)
            before = sum(len(each.slope) for each in atoms)
            atoms.append(found._replace(curve=before + found.curve))
    together = jax.tree.map(lambda *leaves: np.concatenate(leaves), *atoms)
    return Components(names, together, tuple(spaces))


def principal(columns: Float[np.ndarray, "k n"], most: int = MOST_COLUMNS):
    """Return at most so many columns with nearly the same covariance, shape (j, n)."""
    if len(columns) <= most:
        return columns
    return np.linalg.eigh(columns @ columns.T)[1][:, -most:].T @ columns


def _curves(effect: type[Effect], problem: LinearProblem, values: dict):
    found = effect_curves(effect, values, problem.base, problem.padded, problem.reading)
    return found[:, : len(problem.y)]


def _table(grid: ParameterGrid, problem: LinearProblem, amplitudes):
    """Return curves at all shape points and amplitudes, shape (s, a, n)."""
    count = len(amplitudes)
    values = {name: np.repeat(value, count) for name, value in grid.shapes.items()}
    values[grid.amplitudes[0]] = np.tile(amplitudes, grid.size)
    found = _curves(grid.effect, problem, values)
    return found.reshape(grid.size, count, -1)


def _one_amplitude(owner: int, grid: ParameterGrid, problem: LinearProblem) -> Atoms:
    unit = grid.mean + 2.0 * grid.sd
    table = _table(grid, problem, np.array([unit, unit / 2.0]))
    deviation = np.max(np.abs(table[:, 0] - 2.0 * table[:, 1]))
    if grid.normal and deviation <= _NONLINEAR * np.max(np.abs(table)):
        return _linear_atoms(owner, grid, table[:, 0] / unit)
    cells = make_grid(grid.effect, problem.priors, FINE, "cells")
    return _cell_atoms(owner, cells, problem)


def _widths(grid: ParameterGrid) -> tuple[np.ndarray, np.ndarray]:
    """Return factors on the prior sd of an amplitude, and their probabilities."""
    return (SCALES, SCALE_WEIGHTS) if grid.centred else (np.ones(1), np.ones(1))


def _linear_atoms(
    owner: int, grid: ParameterGrid, slope: Float[np.ndarray, "s n"]
) -> Atoms:
    scales, weights = _widths(grid)
    sds = np.tile(grid.sd * scales, len(slope))
    sides, same = 2.0 if grid.one_sided else 1.0, np.ones(len(sds))
    return Atoms(
        owner=np.full(len(sds), owner),
        shape=np.repeat(np.arange(grid.size), len(scales)),
        curve=np.repeat(np.arange(grid.size), len(scales)),
        amplitude=Amplitudes(
            low=(0.0 if grid.one_sided else -np.inf) * same,
            high=np.inf * same,
            mean=grid.mean * same,
            precision=sds**-2.0,
            log_height=np.log(sides / (sds * np.sqrt(2.0 * np.pi))),
        ),
        log_weight=np.tile(np.log(weights), grid.size) - np.log(grid.size),
        offset=np.zeros_like(slope),
        slope=slope,
    )


def _cell_atoms(owner: int, grid: ParameterGrid, problem: LinearProblem) -> Atoms:
    edges = grid.edges
    table, width = _table(grid, problem, edges), np.diff(edges)
    slope = np.diff(table, axis=1) / width[:, None]
    offset = table[:, :-1] - slope * edges[:-1, None]
    log_height = np.tile(np.log(_cell_mass(grid) / width), grid.size)
    none = np.zeros(len(log_height))
    return Atoms(
        owner=np.full(len(none), owner),
        shape=np.repeat(np.arange(grid.size), len(width)),
        curve=np.arange(len(none)),
        amplitude=Amplitudes(
            low=np.tile(edges[:-1], grid.size),
            high=np.tile(edges[1:], grid.size),
            mean=none,
            precision=none,
            log_height=log_height,
        ),
        log_weight=none - np.log(grid.size),
        offset=offset.reshape(len(none), -1),
        slope=slope.reshape(len(none), -1),
    )


def _cell_mass(grid: ParameterGrid) -> Float[np.ndarray, " c"]:
    """Return the prior probability of each amplitude cell."""
    if not grid.normal:
        return np.maximum(grid.mass, 1e-300)
    scales, weights = _widths(grid)
    steps = (grid.edges - grid.mean) / grid.sd
    below = 0.5 * erf(steps[:, None] / (np.sqrt(2.0) * scales)) @ weights
    return np.maximum((2.0 if grid.one_sided else 1.0) * np.diff(below), 1e-300)


def _several_amplitudes(
    owner: int, effect: type[Effect], problem: LinearProblem
) -> list[Space]:
    """Return a space for each shape point of an effect with several amplitudes."""
    grid = make_grid(effect, problem.priors, kind="subspace")
    shown = np.flatnonzero(_shown(grid, problem))
    shapes = {name: values[shown] for name, values in grid.shapes.items()}
    table = _curves(effect, problem, grid.one_amplitude_each(shapes))
    table = table.reshape(len(shown), len(grid.amplitudes), -1)
    weights = np.log(SCALE_WEIGHTS) - np.log(len(table))
    return [
        Space(owner, columns, SCALES, weights, int(shape))
        for shape, columns in zip(shown, table, strict=True)
    ]


def _shown(grid: ParameterGrid, problem: LinearProblem) -> Bool[np.ndarray, " s"]:
    """Return the shape points that these rows can show.

    Less than one period is a bend like any other. Where the prior has only longer
    periods than the stroke, the period is known and all points stay.
    """
    if not grid.effect.period:
        return np.ones(grid.size, bool)
    stroke = np.ptp(problem.records.deformation) * problem.reading.radial_per_read
    shown = grid.shapes[grid.effect.period] <= stroke
    return shown if shown.any() else ~shown


def _members(owner: int, effect: type[Scatter], problem: LinearProblem) -> Space:
    """Return the space of members (runs, specimens) that deviate by one unit each."""
    label = np.asarray(getattr(problem.records, effect.members))
    padded = getattr(problem.padded, effect.members)
    score = np.asarray(scores(padded))[: len(label)]
    added = _curves(effect, problem, {"sd": np.ones(1)})[0] / score
    columns = added * (label == np.unique(label)[:, None])
    sd = make_grid(effect, problem.priors).sd
    edges = np.concatenate([[0.0], np.sqrt(STEPS[1:] * STEPS[:-1]), [np.inf]])
    below = erf(edges[:, None] / (np.sqrt(2.0) * SCALES)) @ SCALE_WEIGHTS
    log_mass = np.log(np.maximum(np.diff(below), 1e-300))
    return Space(owner, principal(columns), sd * STEPS, log_mass)


def atom_on_runs(
    effect: type[Effect], problem: LinearProblem, atom: Atoms, runs: Records
) -> tuple[Float[np.ndarray, "r n"], Float[np.ndarray, "r n"]]:
    """Return offset and slope of one atom on other rows than it was made of [N].

    Args:
        effect: of the atom.
        problem: that the atom was made of.
        atom: a single one.
        runs: the other rows, several times as many, of shape (r, n).
    """
    shape, amplitude = int(atom.shape[0]), atom.amplitude
    linear = float(amplitude.precision[0]) > 0.0
    grid = make_grid(effect, problem.priors, FINE, "linear" if linear else "cells")
    unit = grid.mean + 2.0 * grid.sd
    ends = (0.0, unit) if linear else (amplitude.low[0], amplitude.high[0])
    values = {name: np.full(2, each[shape]) for name, each in grid.shapes.items()}
    values[grid.amplitudes[0]] = np.array(ends)
    found = curves_on_runs(effect, values, problem.base, runs, problem.reading)
    slope = (found[:, 1] - found[:, 0]) / (ends[1] - ends[0])
    return found[:, 0] - slope * ends[0], slope


def space_on_runs(
    effect: type[Effect], problem: LinearProblem, shape: int, runs: Records
) -> Float[np.ndarray, "r j n"]:
    """Return the columns of an effect with several amplitudes on other rows [N].

    Args:
        effect: with several amplitudes.
        problem: that its space was made of.
        shape: index of the point of its shape parameters.
        runs: the other rows, several times as many, of shape (r, n).
    """
    grid = make_grid(effect, problem.priors, kind="subspace")
    shapes = {name: values[[shape]] for name, values in grid.shapes.items()}
    values = grid.one_amplitude_each(shapes)
    return curves_on_runs(effect, values, problem.base, runs, problem.reading)
