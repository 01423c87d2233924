"""Which parameters the data cannot tell apart, said in words."""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from hdcal.inference.distributions import moments
from hdcal.inference.sampled_problem import Sampled

# A leftover direction is named with the parameters that carry this part of it.
_SHARE = 0.3
# A parameter moves the mean less than this many noise sds over its whole prior: dead.
_DEAD = 1e-3


def remove_members(column: np.ndarray, members: np.ndarray) -> np.ndarray:
    """Return what of a column the members leave, the unit priors of theirs included.

    The squared length of the result is the information on the column's parameter
    with the members integrated out.

    Args:
        column: in noise sds, shape (n,).
        members: from `linearise`, in noise sds, shape (n, m).
    """
    size = members.shape[1]
    taken = np.linalg.solve(np.eye(size) + members.T @ members, members.T @ column)
    return np.concatenate([column - members @ taken, -taken])


def dead_parameters(slopes: Mapping[str, np.ndarray], problem: Sampled) -> list[str]:
    """Return the parameters that these data cannot see at all.

    Args:
        slopes: from `linearise`, in noise sds.
        problem: priors.
    """
    dead = []
    for name, slope in slopes.items():
        reach = np.sqrt(np.sum(slope**2)) * moments(problem.priors[name], name)[1]
        if reach < _DEAD:
            dead.append(name)
    return dead


def flat_directions(slopes: Mapping[str, np.ndarray], problem: Sampled) -> list[str]:
    """Name what the data leave to the prior: parameters, pairs, then the rest.

    A direction is flat when the data say less along it than the priors do: with J the
    sensitivity in noise sds and S the prior sds, where ‖J v‖² < ‖v/S‖².

    Args:
        slopes: from `linearise`, in noise sds and without the members, dead
            parameters left out.
        problem: priors.

    Returns:
        One sentence for each flat direction.
    """
    # In units of its prior sd every parameter has prior precision one.
    scaled = {
        name: slope * moments(problem.priors[name], name)[1]
        for name, slope in slopes.items()
    }
    unseen = [name for name, column in scaled.items() if column @ column < 1.0]
    sentences = [
        f"{name} is hardly seen by this data; its prior is the answer"
        for name in unseen
    ]
    seen = {name: column for name, column in scaled.items() if name not in unseen}
    if not seen:
        return sentences
    # As few numbers as have the same inner products.
    few = np.linalg.qr(np.stack([*seen.values()], axis=1), mode="r")
    inseparable = _inseparable(dict(zip(seen, np.transpose(few), strict=True)))
    return sentences + [_sentence(names) for names in inseparable]


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
    # Of directions that are alike to rounding the first is told.
    weakest = {
        pair: round(float(_strengths([seen[name] for name in pair])[0][-1]), 9)
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
        return (
            "K and E0 cannot be told apart by this data; their product can, and with "
            "the prior of E0 that tells K"
        )
    listed = ", ".join(names[:-1]) + " and " + names[-1]
    return f"{listed} cannot be told apart by this data; one combination of them can"
