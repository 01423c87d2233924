"""Points of an effect: quantiles of its shape parameters, cells of its amplitude."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.special import erf

from hdcal.data.prior import Prior
from hdcal.inference.distributions import frozen, moments
from hdcal.physics.effect import Effect, parameters

Kind = Literal["linear", "cells", "subspace"]
# Quantiles of a shape parameter; with several, the number of each. An effect that is
# not linear in its amplitude has many cells at each of them, and gets fewer.
_SHAPE_POINTS = {"linear": (25, 7, 4), "cells": (7, 4, 3), "subspace": (31, 5, 3)}
# First and last edge of the amplitude's cells, in prior sds, and number of cells
# between: neighbouring edges differ by a factor √2.
_SMALLEST, _LARGEST, _CELLS = 1.0 / 64.0, 64.0, 24
# Factors on the prior sd of a zero-centred amplitude, and their probabilities: sizes on
# a rig are known to a small factor only, and small ones are as ordinary as large ones.
SCALES = np.array([0.1, 1.0 / 3.0, 1.0, 3.0, 10.0])
SCALE_WEIGHTS = np.array([0.15, 0.2, 0.3, 0.2, 0.15])
# Least probability of a cell, whose logarithm is needed.
_LEAST = 1e-300


@dataclass(frozen=True)
class ParameterGrid:
    """Shape points and amplitude prior of one effect.

    There are several amplitudes only where the effect is linear in them; they share the
    prior of the first. The mean is that of a normal prior, else 0; the sd of a half-
    normal prior is its scale.
    """

    effect: type[Effect]
    amplitudes: tuple[str, ...]
    shapes: dict[str, np.ndarray]
    prior: Prior
    mean: float
    sd: float

    @property
    def size(self) -> int:
        """Number of shape points."""
        return len(next(iter(self.shapes.values()))) if self.shapes else 1

    @property
    def normal(self) -> bool:
        """Whether the prior is normal or half-normal."""
        return self.prior.family in ("normal", "half_normal")

    @property
    def one_sided(self) -> bool:
        """Whether the prior is half-normal."""
        return self.prior.family == "half_normal"

    @property
    def widths(self) -> tuple[np.ndarray, np.ndarray]:
        """Factors on the prior sd of the amplitude, and their probabilities."""
        if self.normal and self.mean == 0.0:
            return SCALES, SCALE_WEIGHTS
        return np.ones(1), np.ones(1)

    @property
    def unit(self) -> float:
        """An amplitude that the prior allows."""
        return self.mean + 2.0 * self.sd

    def at(self, amplitudes, shape: int | None = None) -> dict[str, np.ndarray]:
        """Return parameter values at amplitudes, at one or all shape points.

        The amplitude changes first. Values of several amplitudes have the shape (a,
        number of amplitudes).
        """
        table = np.asarray(amplitudes, float).reshape(-1, len(self.amplitudes))
        points = [shape] if shape is not None else range(self.size)
        values = {
            name: np.repeat(column[list(points)], len(table))
            for name, column in self.shapes.items()
        }
        for name, column in zip(self.amplitudes, table.T, strict=True):
            values[name] = np.tile(column, len(points))
        return values

    def cells(self) -> tuple[Float[np.ndarray, " e"], Float[np.ndarray, " c"]]:
        """Return the edges of amplitude cells, and the prior probability of each."""
        if not self.normal:
            prior = frozen(self.prior)
            ends = np.concatenate([[1e-6], np.linspace(0.02, 0.98, 25), [1.0 - 1e-6]])
            edges = np.unique(prior.ppf(ends))
            return edges, np.maximum(np.diff(prior.cdf(edges)), _LEAST)
        steps = np.geomspace(_SMALLEST, _LARGEST, _CELLS + 1)
        steps = np.concatenate([[0.0], steps])
        if not self.one_sided:
            steps = np.concatenate([-steps[:0:-1], steps])
        scales, weights = self.widths
        below = 0.5 * erf(steps[:, None] / (np.sqrt(2.0) * scales)) @ weights
        mass = (2.0 if self.one_sided else 1.0) * np.diff(below)
        return self.mean + self.sd * steps, np.maximum(mass, _LEAST)


def make_grid(
    effect: type[Effect], priors: Mapping[str, Prior], kind: Kind = "linear"
) -> ParameterGrid:
    """Return the points of one effect; priors are by site, `effect.parameter`."""
    own = {name: priors[f"{effect.name}.{name}"] for name in parameters(effect)}
    amplitudes = tuple(n for n, p in parameters(effect).items() if p.null is not None)
    prior = own[amplitudes[0]]
    if prior.family == "fixed":
        raise ValueError("the amplitude of an effect cannot be fixed")
    normal = prior.family in ("normal", "half_normal")
    return ParameterGrid(
        effect=effect,
        amplitudes=amplitudes,
        shapes=_shapes({n: p for n, p in own.items() if n not in amplitudes}, kind),
        prior=prior,
        mean=float(prior.numbers[0]) if prior.family == "normal" else 0.0,
        sd=float(prior.numbers[-1]) if normal else moments(prior)[1],
    )


def _shapes(free: Mapping[str, Prior], kind: Kind) -> dict[str, np.ndarray]:
    """Return all combinations of equally probable values of the shape parameters."""
    varied = sum(prior.family != "fixed" for prior in free.values())
    counts = _SHAPE_POINTS[kind]
    count = counts[min(max(varied, 1), len(counts)) - 1]
    quantiles = (np.arange(count) + 0.5) / count
    axes = [
        prior.numbers[:1] if prior.family == "fixed" else frozen(prior).ppf(quantiles)
        for prior in free.values()
    ]
    table = np.array(list(product(*axes)), float)
    return dict(zip(free, table.T, strict=True))
