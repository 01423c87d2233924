"""Which parameters the data cannot tell apart, said in words."""

from itertools import combinations

import jax
import numpy as np

from hdcal.data.records import Records
from hdcal.inference.density import predict_rows
from hdcal.inference.density_protocol import Sampled
from hdcal.inference.discrepancy import prior_sd
from hdcal.inference.distributions import frozen
from hdcal.inference.problem import Problem

# Parameters of the mean that are compared; sigma is not one of them, nor is any
# parameter of an effect on the noise.
_MEAN = ("K", "E0", "alpha", "force_offset", "deformation_offset")
# A leftover direction is named with the parameters that carry this part of it.
_SHARE = 0.3
_MOST_MEMBERS = 200
# A parameter moves the mean less than this many noise sds over its whole prior: dead.
_DEAD = 1e-3


def sensitivity(
    problem: Problem, values: dict, records: Records, columns
) -> dict[str, np.ndarray]:
    """Return by how much each parameter moves the mean reading of each row.

    Args:
        problem: structure.
        values: one set of parameters, in code units.
        records: the rows.
        columns: basis of the gap, or None.

    Returns:
        Derivatives [N per unit of the parameter], shape (n,), by parameter.
    """
    of_mean = {effect.name for effect in problem.effects if effect.stage != "noise"}
    sizes = [name for name in values if name.partition(".")[0] in of_mean]
    names = [n for n in (*_MEAN, *sizes) if n in values]
    moved = {name: values[name] for name in names if _varies(problem, name)}

    def mean(part):
        return predict_rows(problem, {**values, **part}, records, columns)[0]

    slopes = jax.jacfwd(mean)(moved)
    return {name: np.asarray(slope) for name, slope in slopes.items()}


def member_columns(
    problem: Problem, values: dict, records: Records, columns
) -> tuple[np.ndarray, np.ndarray]:
    """Return what runs, specimens and the gap can take up, per prior sd of each.

    Args:
        problem: structure.
        values: one set of parameters, in code units.
        records: the rows.
        columns: basis of the gap, or None.

    Returns:
        Contributions to the mean reading [N], shape (n, m), and where the values
        stand, in prior sds, shape (m,). Members by the hundred are left out: one by
        one none of them matters.
    """
    table, place = [np.zeros((len(records.force), 0))], [np.zeros(0)]

    def stiffer(share):
        stiff = {**values, "K": values["K"] * (1.0 + share)}
        return predict_rows(problem, stiff, records, columns)[0]

    if 0 < problem.runs <= _MOST_MEMBERS:
        sd = values["run_offset_sd"]
        table.append(sd * (records.run[:, None] == np.arange(problem.runs)))
        place.append(values["run_offset"] / sd)
    if 0 < problem.specimens <= _MOST_MEMBERS:
        sd = values["specimen_sd"]
        each = np.asarray(jax.jvp(stiffer, (0.0,), (1.0,))[1])
        own = records.specimen[:, None] == np.arange(problem.specimens)
        table.append(sd * each[:, None] * own)
        place.append(values["specimen_deviation"] / sd)
    if columns is not None:
        scale = np.asarray(prior_sd(values["gap_sd"], values["gap_length"]))
        table.append(np.asarray(columns) * scale)
        place.append(values["gap_weights"] / scale)
    return np.concatenate(table, axis=1), np.concatenate(place)


def beside_members(column: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Return what of a column the members leave, the unit priors of theirs included.

    The squared length of the result is the information on the column's parameter
    with the members integrated out.

    Args:
        column: in noise sds, shape (n,).
        members: from `member_columns`, in noise sds, shape (n, m).
    """
    size = members.shape[1]
    taken = np.linalg.solve(np.eye(size) + members.T @ members, members.T @ column)
    return np.concatenate([column - members @ taken, -taken])


def _varies(problem: Problem, name: str) -> bool:
    return problem.priors[name].family != "fixed"


def dead_parameters(slopes: dict, problem: Sampled) -> list[str]:
    """Return the parameters that these data cannot see at all.

    Args:
        slopes: from `sensitivity`, in noise sds.
        problem: priors.
    """
    dead = []
    for name, slope in slopes.items():
        reach = np.sqrt(np.sum(slope**2)) * frozen(problem.priors[name]).std()
        if reach < _DEAD:
            dead.append(name)
    return dead


def flat_directions(slopes: dict, problem: Sampled) -> list[str]:
    """Name what the data leave to the prior: parameters, pairs, then the rest.

    A direction is flat when the data say less along it than the priors do: with J the
    sensitivity in noise sds and S the prior sds, where ‖J v‖² < ‖v/S‖².

    Args:
        slopes: from `sensitivity`, in noise sds and beside the members, dead
            parameters left out.
        problem: priors.

    Returns:
        One sentence for each flat direction.
    """
    # In units of its prior sd every parameter has prior precision one.
    scaled = {
        name: slope * frozen(problem.priors[name]).std()
        for name, slope in slopes.items()
    }
    unseen = [name for name, column in scaled.items() if column @ column < 1.0]
    sentences = [
        f"{name} is hardly seen by this data; its prior is the answer"
        for name in unseen
    ]
    seen = {name: column for name, column in scaled.items() if name not in unseen}
    return sentences + [_sentence(names) for names in _inseparable(seen)]


def _strengths(columns) -> tuple[np.ndarray, np.ndarray]:
    """Return singular values, largest first, and right singular vectors."""
    table = np.stack(columns, axis=1)
    # One singular value per column, also with fewer rows than columns.
    padded = np.vstack([table, np.zeros((table.shape[1], table.shape[1]))])
    _, strength, vectors = np.linalg.svd(padded, full_matrices=False)
    return strength, vectors


def _inseparable(seen: dict[str, np.ndarray]) -> list[list[str]]:
    """Return as many groups as there are flat directions, pairs before larger ones."""
    if len(seen) < 2:
        return []
    strength, vectors = _strengths(list(seen.values()))
    flat = int(np.sum(strength < 1.0))
    weakest = {
        pair: _strengths([seen[name] for name in pair])[0][-1]
        for pair in combinations(seen, 2)
    }
    groups: list[list[str]] = []
    linked: dict[str, set[str]] = {name: {name} for name in seen}
    for (one, other), least in sorted(weakest.items(), key=lambda item: item[1]):
        if least >= 1.0 or len(groups) == flat:
            break
        # A pair that others already link is no further direction.
        if other not in linked[one]:
            joined = linked[one] | linked[other]
            linked |= dict.fromkeys(joined, joined)
            groups.append([one, other])
    for vector in vectors[::-1][: flat - len(groups)]:
        part = np.abs(vector) / np.abs(vector).max()
        names = [n for n, p in zip(seen, part, strict=True) if p >= _SHARE]
        if len(names) > 2:
            groups.append(names)
    return groups


def _sentence(names: list[str]) -> str:
    if set(names) == {"K", "E0"}:
        return "K and E0 cannot be told apart by this data; their product can"
    listed = ", ".join(names[:-1]) + " and " + names[-1]
    return f"{listed} cannot be told apart by this data; one combination of them can"
