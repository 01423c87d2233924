"""Classes: effects that these readings do not separate."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from hdcal.evidence.parts import mean_curves
from hdcal.evidence.search import Searched
from hdcal.evidence.table import Names

# Squared cosine of the angle between what the base model leaves of two effects from
# which they are one class: within 18 degrees.
ALIKE = 0.9
# An effect is excluded by another one at odds of a hundred (Jeffreys, Theory of
# Probability, 1961: decisive). Effects of less probability lead no class.
_EXCLUDED = _LEAST = 0.01


def classes(
    searched: Searched, posterior: Mapping[Names, np.ndarray]
) -> list[tuple[str, ...]]:
    """Return classes of effects on the mean reading, each with its likeliest first.

    The likeliest effect, as fitted in its likeliest hypothesis, is in one class with
    all that the readings do not exclude given it and whose curves, each fitted alone,
    coincide with it. An effect is in one class at most.

    Args:
        searched: hypotheses of the case.
        posterior: probability of each, by model of the noise.
    """
    chance = dict.fromkeys(searched.table.names[:-1], 0.0)
    for key, each in posterior.items():
        for name in chance.keys() & {*key}:
            chance[name] += float(each.sum())
    left = sorted(chance, key=lambda name: -chance[name])
    found = []
    while left and chance[left[0]] > _LEAST:
        leader = left.pop(0)
        keys = [key for key in posterior if leader in key]
        key = max(keys, key=lambda key: posterior[key].sum())
        curve, least = _direction(searched, key, leader), _EXCLUDED * chance[leader]
        alike = [
            name
            for name in left
            if chance[name] >= least
            and (curve @ _direction(searched, (name,), name)) ** 2 >= ALIKE
        ]
        left = [name for name in left if name not in alike]
        found.append((leader, *alike))
    return found


def _direction(searched: Searched, key: Names, name: str) -> Float[np.ndarray, " n"]:
    """Return what the base model leaves of an effect of a hypothesis, of unit length.

    At the fitted shape, rows weighted by their stated noise. Zero where the hypothesis
    has no evidence.
    """
    table, problem = searched.table, searched.problem
    parts = table.parts.get(key)
    if parts is None:
        return np.zeros(len(problem.y))
    curves = mean_curves(problem, table.likeliest_noise(key), parts)
    names = [table.names[part.component] for part in parts]
    curve = curves[names.index(name)]
    return curve / max(float(np.linalg.norm(curve)), 1e-300)
