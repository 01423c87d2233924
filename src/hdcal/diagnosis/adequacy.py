"""Whether a hypothesis fits: a posterior predictive check of its residuals."""

import numpy as np

from hdcal.evidence.parts import posterior
from hdcal.evidence.search import Searched
from hdcal.evidence.table import Names

_DRAWS = 300


def adequacy_p_value(searched: Searched, key: Names, rng: np.random.Generator) -> float:
    """Return how often noise alone leaves as much structure as the readings do.

    Structure is the largest of the shares of the residuals that the kernels of the
    remainder span, each in sds of what noise makes it.

    Args:
        searched: hypotheses of the case.
        key: the hypothesis.
        rng: source of randomness.
    """
    problem, table = searched.problem, searched.table
    if not searched.kernels:
        return 1.0
    noise = table.likeliest_noise(key)
    fit = posterior(problem, noise, table.parts[key])

    def white(curves):
        return problem.whiten(curves, noise.weight, noise.correlation)

    half = fit.factor @ white(fit.columns.T) / problem.noise_sd
    readings = white((problem.y - fit.offset)[None])
    simulated = rng.standard_normal((_DRAWS, len(problem.y)))
    errors = np.concatenate([readings, simulated])
    errors = errors - (errors @ half.T) @ half
    errors = errors / np.linalg.norm(errors, axis=1, keepdims=True)
    inside = [
        np.log(np.sum((errors @ white(kernel).T) ** 2, axis=1) + 1e-300)
        for kernel in searched.kernels
    ]
    table_of = np.stack(inside, axis=1)
    null = table_of[1:]
    largest = np.max((table_of - null.mean(axis=0)) / null.std(axis=0), axis=1)
    return float((1 + np.sum(largest[1:] >= largest[0])) / (_DRAWS + 1))
