"""Evidence of all items given a context, under one model of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import jax
import numpy as np
from jaxtyping import Float, Int

from hdcal.evidence.components import Components
from hdcal.evidence.items import MOST_COLUMNS, STEPS, Amplitudes, Atoms, Space
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.marginal import Marginal
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import CoefficientPrior, Context, Part
from hdcal.evidence.projection import Block, Projection

# Relative sds by which a shape may deviate from the library's, and their probabilities.
_TOLERANCES = np.array([0.0, 0.1, 0.2])
_TOLERANCE_WEIGHTS = np.array([0.4, 0.3, 0.3])
# Most columns of a narrow space. Padded to the widest ones most would be padding.
_NARROW = 4
# Atoms of each effect that are evaluated given tolerances and contexts.
_CHOSEN = 8
# Sizes of a space of less probability are not drawn.
_UNLIKELY = 0.01


@dataclass
class Selection:
    """Atoms and spaces that are compared given every context.

    `atoms` are the most probable ones, with the weight of all; `tolerance` are columns
    of their shapes' tolerance at a relative sd of 1. The remainder is the last name.
    """

    problem: LinearProblem
    atoms: Atoms
    tolerance: Float[np.ndarray, "m l n"]
    spaces: tuple[Space, ...]
    names: tuple[str, ...]
    _blocks: tuple[Block, Block, Block] = field(init=False)

    def __post_init__(self) -> None:
        self.spaces = tuple(sorted(self.spaces, key=_is_narrow))
        atoms, shape = self.atoms, (len(self.atoms.owner), len(_TOLERANCES))
        narrow = [space for space in self.spaces if _is_narrow(space)]
        wide, rows = self.spaces[: len(self.spaces) - len(narrow)], len(self.problem.y)
        each = Block(
            atoms.owner,
            atoms.amplitude,
            np.broadcast_to(_TOLERANCES**2, shape),
            atoms.log_weight[:, None] + np.log(_TOLERANCE_WEIGHTS),
            *(atoms.offset, atoms.slope, self.tolerance),
        )
        padded = _padded(wide, MOST_COLUMNS, rows), _padded(narrow, _NARROW, rows)
        self._blocks = each, *padded

    def evaluate(
        self,
        noise: NoiseModel,
        context: Context,
        extra: Sequence[Space] = (),
        only: set[int] | None = None,
    ) -> "Evaluated":
        """Evaluate all items, or those of some components, and more narrow spaces."""
        projection = Projection(self.problem, noise, context)
        (atoms, wide, narrow), rows = self._blocks, len(self.problem.y)
        nothing = Space(-1, np.zeros((0, rows)), np.ones(1), np.zeros(1))
        more = _padded([*extra, nothing], _NARROW, rows)
        narrow = jax.tree.map(lambda *parts: np.concatenate(parts), narrow, more)
        tables = (projection.evaluate(each, only)[0] for each in (wide, narrow))
        spaces = np.concatenate([*tables])
        return Evaluated(
            selection=self,
            none=float(spaces[-1, 0]),
            atoms=projection.evaluate(atoms, only),
            spaces=spaces[:-1],
            space_owner=np.concatenate([wide.owner, narrow.owner])[:-1],
            extra=tuple(extra),
        )


def _is_narrow(space: Space) -> bool:
    return len(space.columns) <= _NARROW


def _padded(spaces: Sequence[Space], width: int, rows: int) -> Block:
    """Return spaces of at most so many columns; padded scales have no weight."""
    count = len(spaces)
    columns = np.zeros((count, width, rows))
    scale = np.ones((count, len(STEPS)))
    log_weight = np.full_like(scale, -np.inf)
    for k, space in enumerate(spaces):
        columns[k, : len(space.columns)] = space.columns
        scale[k, : len(space.scale)] = space.scale
        log_weight[k, : len(space.scale)] = space.log_weight
    # A slope of zero with a normal amplitude changes no evidence.
    none, one, no_curve = np.zeros(count), np.ones(count), np.zeros((count, rows))
    height = np.full(count, -0.5 * np.log(2.0 * np.pi))
    amplitude = Amplitudes(-np.inf * one, np.inf * one, none, one, height)
    owner = np.array([space.owner for space in spaces], int)
    curves = no_curve, no_curve, columns
    return Block(owner, amplitude, scale**2, log_weight, *curves)


@dataclass(frozen=True)
class Evaluated:
    """Log evidence of all items given one context, and of the context alone (`none`).

    `extra` are the last of the spaces: those that belong to this context.
    """

    selection: Selection
    none: float
    atoms: Marginal
    spaces: Float[np.ndarray, "s t"]
    space_owner: Int[np.ndarray, " s"]
    extra: tuple[Space, ...]

    def _table(self, component: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the log evidence of the items among which a component's are."""
        owner = self.selection.atoms.owner
        if np.any(owner == component):
            return self.atoms.log_evidence, owner
        return self.spaces, self.space_owner

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
        return float(self._table(part.component)[0][part.place]) + part.spread

    def likeliest(self, component: int) -> Part:
        """Return a component at its most probable item."""
        table, owner = self._table(component)
        members = np.flatnonzero(owner == component)
        some = table[members]
        row, column = np.unravel_index(np.argmax(some), some.shape)
        spread = float(np.logaddexp.reduce(some, axis=None) - some.max())
        place = int(members[row]), int(column)
        if table is self.spaces:
            space = [*self.selection.spaces, *self.extra][place[0]]
            return _space_part(space, place, spread, table[place[0]])
        return self._atom_part(component, place, spread)

    def _atom_part(self, component: int, place: tuple[int, int], spread: float) -> Part:
        selection, row = self.selection, place[0]
        atom = selection.atoms.pick(np.array([row]))
        size = atom.bounded(self.atoms.mean[place][None])
        of_component = selection.atoms.owner == component
        least = selection.atoms.amplitude.low[of_component].min()
        low, high = atom.amplitude.low[0], atom.amplitude.high[0]
        sd = np.maximum(np.abs(size), self.atoms.sd[place])
        chances = _probabilities(self.atoms.log_evidence[row])
        return Part(
            component=component,
            offset=atom.offset[0],
            columns=atom.slope,
            mean=size,
            loose=selection.tolerance[row],
            priors=tuple(
                CoefficientPrior(float(chances[k]), sd, float(_TOLERANCES[k]))
                for k in np.argsort(-chances)
            ),
            one_sided=bool(least >= 0.0),
            shape=int(atom.shape[0]),
            chord=(float(low), float(high)) if np.isfinite(high) else (0.0, 1.0),
            place=place,
            spread=spread,
        )


def _probabilities(log_evidence: Float[np.ndarray, " t"]) -> Float[np.ndarray, " t"]:
    return np.exp(log_evidence - np.logaddexp.reduce(log_evidence))


def _space_part(
    space: Space, place: tuple[int, int], spread: float, log_evidence: np.ndarray
) -> Part:
    count, rows = space.columns.shape
    chances = _probabilities(log_evidence)
    ranked = [k for k in np.argsort(-chances) if chances[k] > _UNLIKELY]
    return Part(
        component=space.owner,
        offset=np.zeros(rows),
        columns=space.columns,
        mean=np.zeros(count),
        loose=np.zeros((0, rows)),
        priors=tuple(
            CoefficientPrior(float(chances[k]), np.full(count, space.scale[k]))
            for k in ranked
        ),
        shape=space.shape,
        place=place,
        spread=spread,
    )


def select(
    problem: LinearProblem,
    noises: Sequence[NoiseModel],
    effects: Components,
    kernels: Sequence[Space],
    names: tuple[str, ...],
) -> Selection:
    """Return the most probable atoms of each effect over all noise models."""
    atoms, spaces = effects.atoms, (*effects.spaces, *kernels)
    if not len(atoms.owner):
        tolerance = np.zeros((0, *problem.tolerance.shape))
        return Selection(problem, atoms, tolerance, spaces, names)
    none = Context(np.zeros(len(problem.y)), np.zeros((0, len(problem.y))))
    curves = atoms.offset, atoms.slope, atoms.curve, atoms.amplitude
    found = [
        Projection(problem, each, none).evaluate_curves(*curves) for each in noises
    ]
    table = np.stack([each.log_evidence[:, 0] for each in found]) + atoms.log_weight
    sizes = np.stack([atoms.bounded(each.mean[:, 0]) for each in found])
    size = np.take_along_axis(sizes, np.argmax(table, axis=0)[None], axis=0)[0]
    whole = np.logaddexp.reduce(table, axis=0)
    chosen, rest = [], []
    for owner in np.unique(atoms.owner):
        members = np.flatnonzero(atoms.owner == owner)
        best = members[np.argsort(-whole[members], kind="stable")[:_CHOSEN]]
        more = np.logaddexp.reduce(whole[members]) - np.logaddexp.reduce(whole[best])
        chosen.append(best)
        rest.append(np.full(len(best), more))
    index = np.concatenate(chosen)
    picked = atoms.pick(index)
    picked = picked._replace(log_weight=picked.log_weight + np.concatenate(rest))
    shape = problem.project(picked.offset + size[index, None] * picked.slope)
    tolerance = shape[:, None] * problem.tolerance
    return Selection(problem, picked, tolerance, spaces, names)
