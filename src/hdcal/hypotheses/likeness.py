"""Classes: effects whose curves coincide under this loading."""

from collections.abc import Iterator, Mapping

import numpy as np
from jaxtyping import Float

from hdcal.hypotheses.parts import mean_curves
from hdcal.hypotheses.search import Searched
from hdcal.hypotheses.table import Names

# Squared cosine of the angle between what the base model leaves of two effects from
# which they are one class: within 18 degrees.
ALIKE = 0.9
# Effects of less probability lead no class.
_LEAST = 0.01


def classes(
    searched: Searched, posterior: Mapping[Names, np.ndarray]
) -> list[tuple[str, ...]]:
    """Return classes of effects on the mean reading, each with its likeliest first.

    Beside the likeliest effect, fitted to the readings, stand all effects of which one
    shape reproduces it. An effect is in one class only; those that neither are probable
    nor look like one that is, are in none.

    Args:
        searched: hypotheses of the case.
        posterior: probability of each, by model of the noise.
    """
    chance = dict.fromkeys(searched.shapes, 0.0)
    for key, each in posterior.items():
        for name in chance.keys() & {*key}:
            chance[name] += float(each.sum())
    left = sorted(chance, key=lambda name: -chance[name])
    found = []
    while left and chance[left[0]] > _LEAST:
        leader = left.pop(0)
        curve = fitted_curve(searched, posterior, leader)
        alike = [*_lookalikes(searched, curve, left)]
        left = [name for name in left if name not in alike]
        found.append((leader, *alike))
    return found


def _lookalikes(searched: Searched, curve, names) -> Iterator[str]:
    size = max(float(curve @ curve), 1e-300)
    for name in names:
        inside = (float(np.sum((axes @ curve) ** 2)) for axes in searched.shapes[name])
        if max(inside, default=0.0) >= ALIKE * size:
            yield name


def fitted_curve(
    searched: Searched, posterior: Mapping[Names, np.ndarray], name: str
) -> Float[np.ndarray, " n"]:
    """Return what the base model leaves of an effect in its likeliest hypothesis [N]."""
    table = searched.table
    key = max(
        (key for key in posterior if name in key), key=lambda key: posterior[key].sum()
    )
    parts = table.parts[key]
    curves = mean_curves(searched.problem, table.likeliest_noise(key), parts)
    (index,) = (
        k for k, part in enumerate(parts) if table.names[part.component] == name
    )
    return curves[index]
