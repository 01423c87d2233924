"""Evidence of all items beside a context, under one model of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from hdcal.evidence.components import Atoms, Space
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.marginal import Items, Products, SlopeProducts, log_marginal
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context, Part, Place
from hdcal.evidence.projection import Projection, principal_axes

# Relative sds by which a shape may deviate from the library's, and their probabilities.
_TOLERANCES = np.array([0.0, 0.1, 0.2])
_TOLERANCE_WEIGHTS = np.array([0.4, 0.3, 0.3])


class _Stack(NamedTuple):
    """Spaces padded to one width; scales of zero weight fill shorter grids.

    Attributes:
        owner: index of the component, shape (s,).
        columns: shape (s, j, n).
        scale: shape (s, t).
        log_weight: shape (s, t).
    """

    owner: Int[np.ndarray, " s"]
    columns: Float[np.ndarray, "s j n"]
    scale: Float[np.ndarray, "s t"]
    log_weight: Float[np.ndarray, "s t"]


def _stack(spaces: Sequence[Space]) -> _Stack:
    width = max(len(space.columns) for space in spaces)
    points = max(len(space.scale) for space in spaces)

    def padded(values, size: int, filler: float = 0.0):
        rest = [(0, size - len(values)), *[(0, 0)] * (values.ndim - 1)]
        return np.pad(values, rest, constant_values=filler)

    return _Stack(
        np.array([space.owner for space in spaces]),
        np.stack([padded(space.columns, width) for space in spaces]),
        np.stack([padded(space.scale, points, 1.0) for space in spaces]),
        np.stack([padded(space.log_weight, points, -np.inf) for space in spaces]),
    )


class _Whitened(NamedTuple):
    """Whitened curves of a selection, and Gram matrices of columns."""

    offset: np.ndarray
    slope: np.ndarray
    loose: np.ndarray
    spaces: np.ndarray
    loose_gram: np.ndarray
    space_gram: np.ndarray


@dataclass
class Selection:
    """Atoms and spaces that are compared beside every context.

    Attributes:
        problem: the case.
        atoms: the most probable ones, with the weight of all.
        tolerance: columns of their shapes' tolerance at a relative sd of 1, (m, l, n).
        spaces: effects with several columns, and kernels.
        names: of all components, the remainder last.
    """

    problem: LinearProblem
    atoms: Atoms
    tolerance: Float[np.ndarray, "m l n"]
    spaces: tuple[Space, ...]
    names: tuple[str, ...]
    _white: dict[tuple, _Whitened] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        nothing = np.zeros((1, len(self.problem.y)))
        none = Space(0, nothing, np.ones(1), np.full(1, -np.inf))
        self._stack = _stack(self.spaces or (none,))

    def evaluate(
        self, noise: NoiseModel, context: Context, extra: Sequence[Space] = ()
    ) -> "Evaluated":
        """Evaluate every item.

        Args:
            noise: model of the noise.
            context: what the base contains besides.
            extra: further spaces of the remainder, that depend on the context.
        """
        projection = Projection(self.problem, noise, context)
        white, stack = self._whitened(noise), self._stack
        gram, columns = white.space_gram, white.spaces
        if extra:
            more = _stack(extra)
            added = projection.whiten(more.columns)
            gram = _joined(gram, added @ np.swapaxes(added, 1, 2))
            columns = _joined(columns, added)
            stack = _Stack(
                _joined(stack.owner, more.owner),
                _joined(stack.columns, more.columns),
                _joined(stack.scale, more.scale, filler=1.0),
                _joined(stack.log_weight, more.log_weight, filler=-np.inf),
            )
        return Evaluated(
            selection=self,
            none=projection.evidence_of_none(),
            atoms=self._atoms(projection, white),
            spaces=_spaces(projection, columns, gram, stack),
            space_owner=stack.owner,
            extra=tuple(extra),
        )

    def _whitened(self, noise: NoiseModel) -> _Whitened:
        """Return what does not depend on the context, kept once computed."""
        key = noise.name, noise.correlation, noise.weight.tobytes()
        if key not in self._white:
            offset, slope, loose, spaces = (
                self.problem.whiten(curves, noise.weight, noise.correlation)
                for curves in (
                    self.atoms.offset,
                    self.atoms.slope,
                    self.tolerance,
                    self._stack.columns,
                )
            )
            grams = (c @ np.swapaxes(c, 1, 2) for c in (loose, spaces))
            self._white[key] = _Whitened(offset, slope, loose, spaces, *grams)
        return self._white[key]

    def _atoms(self, projection: Projection, white: _Whitened) -> Items:
        error = projection.y - white.offset
        ee, eu, uu = projection.products(error, white.slope)
        axes = principal_axes(
            projection, white.loose, white.loose_gram, [error, white.slope]
        )
        te, tu = axes.products
        variance = _TOLERANCES[:, None] ** 2
        slope = SlopeProducts(
            eu, uu, variance * (te * tu)[:, None], variance * (tu**2)[:, None]
        )
        lam, te2 = variance * axes.square[:, None], variance * (te**2)[:, None]
        found = log_marginal(
            self.problem.count,
            Products(ee, lam, te2, slope),
            self.atoms.amplitude,
            self.problem.noise_prior,
        )
        weight = self.atoms.log_weight[:, None] + np.log(_TOLERANCE_WEIGHTS)
        log_evidence = found.log_evidence + weight + projection.constant
        return found._replace(log_evidence=log_evidence)


def _joined(one: np.ndarray, other: np.ndarray, *, filler: float = 0.0) -> np.ndarray:
    """Return the entries of both tables, padded to the larger size of each axis."""
    size = np.maximum(one.shape[1:], other.shape[1:])

    def padded(table: np.ndarray) -> np.ndarray:
        rest = [(0, more) for more in size - table.shape[1:]]
        return np.pad(table, [(0, 0), *rest], constant_values=filler)

    return np.concatenate([padded(one), padded(other)])


def _spaces(projection: Projection, columns, gram, stack: _Stack) -> Items:
    count = columns.shape[2]
    y = np.broadcast_to(projection.y, (len(columns), count))
    axes = principal_axes(projection, columns, gram, [y])
    (te,) = axes.products
    variance = stack.scale[..., None] ** 2
    products = Products(
        np.full((len(columns), 1), projection.square),
        variance * axes.square[:, None],
        variance * te[:, None] ** 2,
    )
    problem = projection.problem
    found = log_marginal(problem.count, products, None, problem.noise_prior)
    log_evidence = found.log_evidence + stack.log_weight + projection.constant
    return found._replace(log_evidence=log_evidence)


@dataclass(frozen=True)
class Evaluated:
    """Evidence of all items beside one context.

    Attributes:
        selection: the items.
        none: log evidence of the context alone.
        atoms: those with an amplitude.
        spaces: the others, `extra` last.
        space_owner: component of each space.
        extra: spaces that belong to this context.
    """

    selection: Selection
    none: float
    atoms: Items
    spaces: Items
    space_owner: Int[np.ndarray, " s"]
    extra: tuple[Space, ...]

    def totals(self) -> Float[np.ndarray, " k"]:
        """Return the log evidence of each component."""
        found = np.full(len(self.selection.names), -np.inf)
        for owner, items in (
            (self.selection.atoms.owner, self.atoms),
            (self.space_owner, self.spaces),
        ):
            each = np.logaddexp.reduce(items.log_evidence, axis=1)
            np.logaddexp.at(found, owner, each)
        return found

    def of_part(self, part: Part) -> float:
        """Return the log evidence of a part that was found elsewhere."""
        atomic = np.any(self.selection.atoms.owner == part.component)
        items = self.atoms if atomic else self.spaces
        return float(items.log_evidence[part.place]) + part.spread

    def likeliest(self, component: int) -> Part:
        """Return a component at its most probable item."""
        if np.any(self.selection.atoms.owner == component):
            return self._likeliest_atom(component)
        return self._likeliest_space(component)

    def _likeliest_atom(self, component: int) -> Part:
        selection = self.selection
        members = np.flatnonzero(selection.atoms.owner == component)
        place, spread = _largest(self.atoms.log_evidence, members)
        atom = selection.atoms.pick([place.row])
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
            one_sided=bool(low.min() == 0.0),
            place=place,
            spread=spread,
            levels=levels,
        )

    def _likeliest_space(self, component: int) -> Part:
        members = np.flatnonzero(self.space_owner == component)
        place, spread = _largest(self.spaces.log_evidence, members)
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
