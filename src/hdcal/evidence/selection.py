"""The most probable atoms of each effect, which stand for all of them."""

from collections.abc import Sequence

import numpy as np

from hdcal.evidence.components import Atoms, Components, Space
from hdcal.evidence.evaluation import Selection
from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.marginal import Items, Products, log_marginal
from hdcal.evidence.noise_models import NoiseModel
from hdcal.evidence.parts import Context
from hdcal.evidence.projection import Projection

# Atoms of each effect that are evaluated beside tolerances and contexts.
_CHOSEN = 8


def select(
    problem: LinearProblem,
    noises: Sequence[NoiseModel],
    effects: Components,
    kernels: Sequence[Space],
    names: tuple[str, ...],
) -> Selection:
    """Return the most probable atoms of each effect, with the weight of all of them.

    Args:
        problem: the case.
        noises: models of the noise over which atoms are compared.
        effects: of the library.
        kernels: of the remainder.
        names: of all components, the remainder last.
    """
    atoms, nothing = effects.atoms, np.zeros((len(problem.y),))
    if not len(atoms.owner):
        tolerance = np.zeros((0, *problem.tolerance.shape))
        return Selection(problem, atoms, tolerance, (*effects.spaces, *kernels), names)
    tables, sizes = [], []
    for noise in noises:
        none = Context(nothing, np.zeros((0, len(problem.y))))
        found = _alone(Projection(problem, noise, none), atoms)
        tables.append(found.log_evidence[:, 0])
        sizes.append(atoms.bounded(found.mean[:, 0]))
    table = np.stack(tables)
    best_noise = np.argmax(table, axis=0)[None]
    size = np.take_along_axis(np.stack(sizes), best_noise, axis=0)[0]
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
    return Selection(problem, picked, tolerance, (*effects.spaces, *kernels), names)


def _alone(projection: Projection, atoms: Atoms) -> Items:
    """Return the evidence of atoms whose shapes do not deviate."""
    problem = projection.problem
    curves = projection.curves(*map(projection.whiten, (atoms.offset, atoms.slope)))
    none, single = np.zeros((len(atoms.owner), 0)), np.zeros((len(atoms.owner), 1))
    ee, eu, uu = (each[atoms.curve] for each in curves[:3])
    products = Products(ee, eu, uu, none, none, none)
    found = log_marginal(
        problem.count, products, single, atoms.amplitude, problem.noise_prior
    )
    weight = atoms.log_weight[:, None] + projection.constant
    return found._replace(log_evidence=found.log_evidence + weight)
