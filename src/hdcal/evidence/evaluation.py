"""Evidence of all items beside a context, under one model of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

import numpy as np
from jaxtyping import Float, Int

from hdcal.evidence.components import MOST_COLUMNS, STEPS, Amplitudes, Atoms, Space
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.marginal import Items, Products, log_marginal
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context, Part, Place
from hdcal.evidence.projection import Projection

# Relative sds by which a shape may deviate from the library's, and their probabilities.
_TOLERANCES = np.array([0.0, 0.1, 0.2])
_TOLERANCE_WEIGHTS = np.array([0.4, 0.3, 0.3])
# Most columns of a narrow space. Padded to the widest ones most would be padding.
_NARROW = 4
# Models of the noise whose whitened curves are kept: those of pairs.
_KEPT = 2


class _Spaces(NamedTuple):
    """Spaces padded to one width; scales of zero weight fill shorter grids.

    Attributes:
        owner: index of the component, shape (s,).
        columns: shape (s, j, n); whitened for a model of the noise.
        gram: their inner products, shape (s, j, j).
        scale: shape (s, t).
        log_weight: shape (s, t).
    """

    owner: Int[np.ndarray, " s"]
    columns: Float[np.ndarray, "s j n"]
    gram: Float[np.ndarray, "s j j"]
    scale: Float[np.ndarray, "s t"]
    log_weight: Float[np.ndarray, "s t"]


class _Atoms(NamedTuple):
    """Whitened curves of atoms, and products of the columns of their tolerance.

    Attributes:
        offset: shape (m, n).
        slope: shape (m, n).
        loose: columns of the tolerance, shape (m, l, n).
        gram: of these with each other, shape (m, l, l).
        with_offset: of these with the offset, shape (m, l).
        with_slope: of these with the slope, shape (m, l).
    """

    offset: Float[np.ndarray, "m n"]
    slope: Float[np.ndarray, "m n"]
    loose: Float[np.ndarray, "m l n"]
    gram: Float[np.ndarray, "m l l"]
    with_offset: Float[np.ndarray, "m l"]
    with_slope: Float[np.ndarray, "m l"]


Rows = TypeVar("Rows", _Spaces, _Atoms)


def _pick(table: Rows, rows) -> Rows:
    return type(table)(*(column[rows] for column in table))


def _gram(columns: Float[np.ndarray, "s j n"]) -> Float[np.ndarray, "s j j"]:
    return columns @ np.swapaxes(columns, 1, 2)


def _padded(spaces: Sequence[Space], width: int, projection: Projection) -> _Spaces:
    """Return spaces of at most so many columns, whitened."""
    count, points = len(spaces), len(STEPS)
    columns = np.zeros((count, width, len(projection.y)))
    scale, log_weight = np.ones((count, points)), np.full((count, points), -np.inf)
    for k, space in enumerate(spaces):
        columns[k, : len(space.columns)] = space.columns
        scale[k, : len(space.scale)] = space.scale
        log_weight[k, : len(space.scale)] = space.log_weight
    owner = np.array([space.owner for space in spaces], int)
    white = projection.whiten(columns)
    return _Spaces(owner, white, _gram(white), scale, log_weight)


@dataclass
class Selection:
    """Atoms and spaces that are compared beside every context.

    Attributes:
        problem: the case.
        atoms: the most probable ones, with the weight of all.
        tolerance: columns of their shapes' tolerance at a relative sd of 1, (m, l, n).
        spaces: effects with several columns, and kernels; wide ones first.
        names: of all components, the remainder last.
    """

    problem: LinearProblem
    atoms: Atoms
    tolerance: Float[np.ndarray, "m l n"]
    spaces: tuple[Space, ...]
    names: tuple[str, ...]
    _white: dict[tuple, tuple[_Atoms, _Spaces, _Spaces]] = field(
        init=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        narrow = [space for space in self.spaces if len(space.columns) <= _NARROW]
        wide = [space for space in self.spaces if len(space.columns) > _NARROW]
        self.spaces = (*wide, *narrow)
        self._wide = len(wide)

    def evaluate(
        self,
        noise: NoiseModel,
        context: Context,
        extra: Sequence[Space] = (),
        only: set[int] | None = None,
    ) -> "Evaluated":
        """Evaluate every item.

        Args:
            noise: model of the noise.
            context: what the base contains besides.
            extra: further narrow spaces of the remainder, that depend on the context.
            only: the components that are wanted; by default all.
        """
        projection = Projection(self.problem, noise, context)
        atoms, wide, narrow = self._whitened(projection)
        empty = np.zeros((0, len(projection.y)))
        nothing = Space(-1, empty, np.ones(1), np.zeros(1))
        more = _padded([*extra, nothing], _NARROW, projection)
        narrow = _Spaces(*map(np.concatenate, zip(narrow, more, strict=True)))
        spaces = np.concatenate(
            [_of_spaces(projection, each, only) for each in (wide, narrow)]
        )
        return Evaluated(
            selection=self,
            none=float(spaces[-1, 0]),
            atoms=self._of_atoms(projection, atoms, only),
            spaces=spaces[:-1],
            space_owner=np.concatenate([wide.owner, narrow.owner])[:-1],
            extra=tuple(extra),
        )

    def _whitened(self, projection: Projection) -> tuple[_Atoms, _Spaces, _Spaces]:
        """Return what does not depend on the context, kept for the last models."""
        noise = projection.noise
        key = noise.name, noise.correlation, noise.weight.tobytes()
        if key not in self._white:
            whiten = projection.whiten
            offset, slope = whiten(self.atoms.offset), whiten(self.atoms.slope)
            loose = whiten(self.tolerance)
            products = (loose @ each[..., None] for each in (offset, slope))
            along = (each[..., 0] for each in products)
            wide, narrow = self.spaces[: self._wide], self.spaces[self._wide :]
            self._white[key] = (
                _Atoms(offset, slope, loose, _gram(loose), *along),
                _padded(wide, MOST_COLUMNS, projection),
                _padded(narrow, _NARROW, projection),
            )
        self._white = dict([*self._white.items()][-_KEPT:])
        return self._white[key]

    def _of_atoms(
        self, projection: Projection, white: _Atoms, only: set[int] | None
    ) -> Items:
        rows = _rows(self.atoms.owner, only)
        white = _pick(white, rows)
        curves = projection.curves(white.offset, white.slope)
        axes = projection.axes(white.loose, white.gram)
        te = axes.products(axes.along_y - white.with_offset, curves.error_q)
        tu = axes.products(white.with_slope, curves.slope_q)
        found = log_marginal(
            self.problem.count,
            Products(*curves[:3], te, tu, axes.square),
            np.broadcast_to(_TOLERANCES**2, (len(te), len(_TOLERANCES))),
            Amplitudes(*(column[rows] for column in self.atoms.amplitude)),
            self.problem.noise_prior,
        )
        weight = self.atoms.log_weight[rows, None] + np.log(_TOLERANCE_WEIGHTS)
        log_evidence = found.log_evidence + weight + projection.constant
        found = found._replace(log_evidence=log_evidence)
        if only is None:
            return found
        shape = len(self.atoms.owner), len(_TOLERANCES)
        return Items(*(_spread(each, rows, shape) for each in found))


def _rows(owner: Int[np.ndarray, " m"], only: set[int] | None):
    """Return the items of some components; of all by default."""
    return slice(None) if only is None else np.flatnonzero(np.isin(owner, [*only]))


def _spread(values, rows, shape: tuple[int, int]) -> Float[np.ndarray, "m t"]:
    """Return a table with values in some rows and no evidence in the others."""
    table = np.full(shape, -np.inf)
    table[rows] = values
    return table


def _of_spaces(
    projection: Projection, spaces: _Spaces, only: set[int] | None
) -> Float[np.ndarray, "s t"]:
    """Return the log evidence of spaces at each scale."""
    rows = _rows(spaces.owner, None if only is None else {*only, -1})
    picked = _pick(spaces, rows)
    count, problem = len(picked.owner), projection.problem
    axes = projection.axes(picked.columns, picked.gram)
    base = np.broadcast_to(projection.y_q, (count, len(projection.y_q)))
    none, no_axes = np.zeros(count), np.zeros_like(axes.square)
    products = Products(
        np.full(count, projection.square),
        none,
        none,
        axes.products(axes.along_y, base),
        no_axes,
        axes.square,
    )
    found = log_marginal(
        problem.count, products, picked.scale**2, None, problem.noise_prior
    )
    log_evidence = found.log_evidence + picked.log_weight + projection.constant
    return _spread(log_evidence, rows, spaces.scale.shape)


@dataclass(frozen=True)
class Evaluated:
    """Evidence of all items beside one context.

    Attributes:
        selection: the items.
        none: log evidence of the context alone.
        atoms: those with an amplitude.
        spaces: log evidence of the others at each scale, `extra` last.
        space_owner: component of each space.
        extra: spaces that belong to this context.
    """

    selection: Selection
    none: float
    atoms: Items
    spaces: Float[np.ndarray, "s t"]
    space_owner: Int[np.ndarray, " s"]
    extra: tuple[Space, ...]

    def totals(self) -> Float[np.ndarray, " k"]:
        """Return the log evidence of each component."""
        found = np.full(len(self.selection.names), -np.inf)
        for owner, log_evidence in (
            (self.selection.atoms.owner, self.atoms.log_evidence),
            (self.space_owner, self.spaces),
        ):
            each = np.logaddexp.reduce(log_evidence, axis=1)
            np.logaddexp.at(found, owner, each)
        return found

    def of_part(self, part: Part) -> float:
        """Return the log evidence of a part that was found elsewhere."""
        atomic = np.any(self.selection.atoms.owner == part.component)
        table = self.atoms.log_evidence if atomic else self.spaces
        return float(table[part.place]) + part.spread

    def likeliest(self, component: int) -> Part:
        """Return a component at its most probable item."""
        if np.any(self.selection.atoms.owner == component):
            return self._likeliest_atom(component)
        return self._likeliest_space(component)

    def _likeliest_atom(self, component: int) -> Part:
        selection = self.selection
        members = np.flatnonzero(selection.atoms.owner == component)
        place, spread = _largest(self.atoms.log_evidence, members)
        atom = selection.atoms.pick(np.array([place.row]))
        size = atom.bounded(self.atoms.mean[place][None])
        low = selection.atoms.amplitude.low[members]
        log_chance = self.atoms.log_evidence[place.row]
        chance = np.exp(log_chance - np.logaddexp.reduce(log_chance))
        loose = _TOLERANCES[:, None, None] * selection.tolerance[place.row]
        levels = tuple(zip(map(float, chance), loose, strict=True))
        return Part(
            component=component,
            offset=atom.offset[0],
            columns=atom.slope,
            mean=size,
            sd=np.maximum(np.abs(size), self.atoms.sd[place]),
            loose=levels[place.column][1],
            one_sided=bool(low.min() >= 0.0),
            place=place,
            spread=spread,
            levels=levels,
        )

    def _likeliest_space(self, component: int) -> Part:
        members = np.flatnonzero(self.space_owner == component)
        place, spread = _largest(self.spaces, members)
        space = [*self.selection.spaces, *self.extra][place.row]
        count, rows = space.columns.shape
        fixed = np.zeros((0, rows))
        return Part(
            component=component,
            offset=np.zeros(rows),
            columns=space.columns,
            mean=np.zeros(count),
            sd=np.full(count, space.scale[place.column]),
            loose=fixed,
            one_sided=False,
            place=place,
            spread=spread,
            levels=((1.0, fixed),),
        )


def _largest(log_evidence, members) -> tuple[Place, float]:
    """Return the place of the largest of some rows, and the log sum of all above it."""
    table = log_evidence[members]
    row, column = np.unravel_index(np.argmax(table), table.shape)
    spread = float(np.logaddexp.reduce(table, axis=None) - table.max())
    return Place(int(members[row]), int(column)), spread
