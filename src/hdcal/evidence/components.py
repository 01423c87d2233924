"""Effects of a library as atoms and spaces.

An effect that is linear in its amplitude has an atom for each point of its shape
parameters and width of its prior; a nonlinear one has an atom, the chord, for each
shape point and amplitude cell. Effects with several amplitudes and members that differ
are spaces.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Bool, Float
from scipy.special import erf

from hdcal.data.prior import Prior
from hdcal.data.records import Records
from hdcal.evidence.items import STEPS, Amplitudes, Atoms, Space, principal
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.parameter_grid import (
    SCALE_WEIGHTS,
    SCALES,
    ParameterGrid,
    amplitudes_of,
    is_zero_centred,
    make_grid,
    prior_rms,
)
from hdcal.inference.distributions import quantiles
from hdcal.inference.force_model.padding import repeat_last_row
from hdcal.inference.force_model.values import MEMBER_SD
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect
from hdcal.physics.effects.scatter import Scatter, scores

# Columns that must be measured for a need of an effect. The other needs (unloading,
# cycles, …) are features of the loading: without them an effect has a prediction, but
# may look like another one.
_COLUMNS = {
    "temperature": "temperature",
    "time": "time",
    "rates": "time",
    "holds or rates": "time",
    "angle": "angle",
    "runs": "run",
    "specimens": "specimen",
    "readings of the rig alone": "readings of the rig alone",
}
# Relative deviation from proportionality from which an effect is nonlinear.
_NONLINEAR = 1e-6
_ROOT_2PI = float(np.sqrt(2.0 * np.pi))
# Points predicted at a time, always as many: one executable serves all grids. With
# many rows fewer, 2**22 numbers of eight bytes being 32 MB.
_BLOCK, _MOST_VALUES = 64, 2**22


def lacking(
    library: Mapping[str, type[Effect]], records: Records
) -> dict[str, tuple[str, ...]]:
    """Return the columns that effects need and that were not measured."""
    known, found = records.known, {}
    for name, effect in library.items():
        columns = {_COLUMNS[n] for n in effect.needs - known if n in _COLUMNS} - known
        if columns:
            found[name] = tuple(sorted(columns))
    return found


@dataclass(frozen=True)
class Components:
    """Effects of a library on the mean reading; scatter of members has no grid."""

    names: tuple[str, ...]
    grids: tuple[ParameterGrid | None, ...]
    atoms: Atoms
    spaces: tuple[Space, ...]


def components(
    effects: Mapping[str, type[Effect]], problem: LinearProblem
) -> Components:
    """Return atoms and spaces of the effects on the mean reading."""
    names = tuple(n for n, effect in effects.items() if effect.stage != "noise")
    none, rows = np.zeros(0), np.zeros((0, len(problem.y)))
    index, nothing = none.astype(int), Amplitudes(*5 * [none])
    atoms = [Atoms(index, index, index, nothing, none, rows, rows)]
    spaces: list[Space] = []
    grids: list[ParameterGrid | None] = []
    for owner, effect in enumerate(effects[name] for name in names):
        if issubclass(effect, Scatter):
            grids.append(None)
            spaces.append(_members(owner, effect, problem))
            continue
        if len(amplitudes_of(effect)) > 1:
            grid = make_grid(effect, problem.priors, "subspace")
            spaces += _several_amplitudes(owner, grid, problem)
        else:
            grid, found = _one_amplitude(owner, effect, problem)
            before = sum(len(each.slope) for each in atoms)
            atoms.append(found._replace(curve=before + found.curve))
        grids.append(grid)
    together = jax.tree.map(lambda *leaves: np.concatenate(leaves), *atoms)
    return Components(names, tuple(grids), together, tuple(spaces))


def _of_rows(effect: type[Effect], values: dict, problem: LinearProblem):
    found = effect_curves(effect, values, problem.base, problem.padded, problem.reading)
    return found[:, : len(problem.y)]


def _one_amplitude(
    owner: int, effect: type[Effect], problem: LinearProblem
) -> tuple[ParameterGrid, Atoms]:
    """Return the atoms of an effect with one amplitude, and the grid that they use."""
    grid = make_grid(effect, problem.priors, "linear")
    if grid.normal:
        ends = np.array([grid.unit, grid.unit / 2.0])
        table = _of_rows(effect, grid.at(ends), problem).reshape(grid.size, 2, -1)
        deviation = np.max(np.abs(table[:, 0] - 2.0 * table[:, 1]))
        if deviation <= _NONLINEAR * np.max(np.abs(table)):
            return grid, _linear_atoms(owner, grid, table[:, 0] / grid.unit)
    cells = make_grid(effect, problem.priors, "cells")
    return cells, _cell_atoms(owner, cells, problem)


def _linear_atoms(
    owner: int, grid: ParameterGrid, slope: Float[np.ndarray, "s n"]
) -> Atoms:
    scales, weights = grid.widths
    sds = np.tile(grid.sd * scales, len(slope))
    sides, same = 2.0 if grid.one_sided else 1.0, np.ones(len(sds))
    point = np.repeat(np.arange(grid.size), len(scales))
    return Atoms(
        owner=np.full(len(sds), owner),
        shape=point,
        curve=point,
        amplitude=Amplitudes(
            low=(0.0 if grid.one_sided else -np.inf) * same,
            high=np.inf * same,
            mean=grid.mean * same,
            precision=sds**-2.0,
            log_height=np.log(sides / (sds * _ROOT_2PI)),
        ),
        log_weight=np.tile(np.log(weights), grid.size) - np.log(grid.size),
        offset=np.zeros_like(slope),
        slope=slope,
    )


def _cell_atoms(owner: int, grid: ParameterGrid, problem: LinearProblem) -> Atoms:
    edges, mass = grid.cells()
    table = _of_rows(grid.effect, grid.at(edges), problem)
    table, width = table.reshape(grid.size, len(edges), -1), np.diff(edges)
    slope = np.diff(table, axis=1) / width[:, None]
    offset = table[:, :-1] - slope * edges[:-1, None]
    none = np.zeros(grid.size * len(width))
    return Atoms(
        owner=np.full(len(none), owner),
        shape=np.repeat(np.arange(grid.size), len(width)),
        curve=np.arange(len(none)),
        amplitude=Amplitudes(
            low=np.tile(edges[:-1], grid.size),
            high=np.tile(edges[1:], grid.size),
            mean=none,
            precision=none,
            log_height=np.tile(np.log(mass / width), grid.size),
        ),
        log_weight=none - np.log(grid.size),
        offset=offset.reshape(len(none), -1),
        slope=slope.reshape(len(none), -1),
    )


def _several_amplitudes(
    owner: int, grid: ParameterGrid, problem: LinearProblem
) -> list[Space]:
    """Return a space for each shape point of an effect with several amplitudes."""
    count = len(grid.amplitudes)
    table = _of_rows(grid.effect, grid.at(np.diag(grid.rms)), problem)
    table = table.reshape(grid.size, count, -1)
    shown = np.flatnonzero(_shown(grid, problem))
    weights = np.log(SCALE_WEIGHTS) - np.log(len(shown))
    return [Space(owner, table[k], SCALES, weights, int(k)) for k in shown]


def _shown(grid: ParameterGrid, problem: LinearProblem) -> Bool[np.ndarray, " s"]:
    """Whether these rows can show each shape point.

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
    added = _of_rows(effect, {"sd": np.ones(1)}, problem)[0] / score
    columns = added * (label == np.unique(label)[:, None])
    sds, log_mass = _member_sds(problem.priors[MEMBER_SD[effect.members]])
    return Space(owner, principal(columns), sds, log_mass)


def _member_sds(prior: Prior) -> tuple[Float[np.ndarray, " t"], ...]:
    """Return sds between members that stand for their prior, with log probabilities."""
    if not is_zero_centred(prior):
        sds = np.abs(quantiles(prior, len(STEPS)))
        return sds, np.full(len(sds), -np.log(len(sds)))
    edges = np.concatenate([[0.0], np.sqrt(STEPS[1:] * STEPS[:-1]), [np.inf]])
    below = erf(edges[:, None] / (np.sqrt(2.0) * SCALES)) @ SCALE_WEIGHTS
    return prior_rms(prior) * STEPS, np.log(np.maximum(np.diff(below), 1e-300))


@jax.jit
def _curves(effects: Effect, base: Base, records: Records, reading: Reading):
    plain, _ = predict_reading(base, (), records, reading)

    def one(effect):
        return predict_reading(base, (effect,), records, reading)[0] - plain

    return jax.vmap(one)(effects)


def effect_curves(
    effect: type[Effect],
    values: dict[str, np.ndarray],
    base: Base,
    padded: Records,
    reading: Reading,
) -> np.ndarray:
    """Return the effect's contribution to the mean reading [N], shape (g, n).

    `values` are those of every parameter, each of shape (g,); `padded` are all rows.
    """
    block = int(np.clip(_MOST_VALUES // len(padded.force), 1, _BLOCK))
    table = {name: np.asarray(column, float) for name, column in values.items()}
    count = len(next(iter(table.values())))
    table = repeat_last_row(table, count + -count % block)
    parts = []
    for start in range(0, count, block):
        some = {name: column[start : start + block] for name, column in table.items()}
        parts.append(np.asarray(_curves(effect(**some), base, padded, reading)))
    return np.concatenate(parts)[:count]
