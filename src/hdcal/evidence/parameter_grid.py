"""Points of an effect: quantiles of its shape parameters, cells of its amplitude."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.special import erf

from hdcal.data.prior import Prior
from hdcal.inference.distributions import frozen, moments, quantiles
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
# Half the width of the cell of a fixed amplitude, relative.
_FIXED = 1e-3


def is_zero_centred(prior: Prior) -> bool:
    """Whether a prior is half-normal, or normal about zero."""
    about_zero = prior.family == "normal" and float(prior.numbers[0]) == 0.0
    return about_zero or prior.family == "half_normal"


def prior_rms(prior: Prior) -> float:
    """Return the root mean square of a prior: the sd of one that is zero-centred."""
    return float(np.hypot(*moments(prior)))


def amplitudes_of(effect: type[Effect]) -> tuple[str, ...]:
    """Return the names of the parameters without which an effect vanishes."""
    return tuple(n for n, p in parameters(effect).items() if p.null is not None)


def is_excluded(effect: type[Effect], priors: Mapping[str, Prior]) -> bool:
    """Whether priors fix all amplitudes of an effect at zero, where it vanishes."""
    stated = [priors.get(f"{effect.name}.{name}") for name in amplitudes_of(effect)]
    return all(prior and prior_rms(prior) == 0.0 for prior in stated)


@dataclass(frozen=True)
class ParameterGrid:
    """Shape points and amplitude prior of one effect.

    Prior, mean and sd are those of the first amplitude: the mean that of a normal
    prior, else 0; the sd of a half-normal prior is its scale. An effect with several
    amplitudes is linear in them; `rms` is the root mean square of the prior of each.
    """

    effect: type[Effect]
    amplitudes: tuple[str, ...]
    shapes: dict[str, np.ndarray]
    prior: Prior
    mean: float
    sd: float
    rms: Float[np.ndarray, " a"]

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
        if is_zero_centred(self.prior):
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
        if self.prior.family == "fixed":
            value = float(self.prior.numbers[0])
            return np.sort([value * (1.0 - _FIXED), value * (1.0 + _FIXED)]), np.ones(1)
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
    amplitudes = amplitudes_of(effect)
    prior = own[amplitudes[0]]
    normal = prior.family in ("normal", "half_normal")
    return ParameterGrid(
        effect=effect,
        amplitudes=amplitudes,
        shapes=_shapes({n: p for n, p in own.items() if n not in amplitudes}, kind),
        prior=prior,
        mean=float(prior.numbers[0]) if prior.family == "normal" else 0.0,
        sd=float(prior.numbers[-1]) if normal else moments(prior)[1],
        rms=np.array([prior_rms(own[name]) for name in amplitudes]),
    )


def _shapes(free: Mapping[str, Prior], kind: Kind) -> dict[str, np.ndarray]:
    """Return all combinations of equally probable values of the shape parameters."""
    varied = sum(prior.family != "fixed" for prior in free.values())
    counts = _SHAPE_POINTS[kind]
    count = counts[min(max(varied, 1), len(counts)) - 1]
    axes = [quantiles(prior, count) for prior in free.values()]
    table = np.array(list(product(*axes)), float)
    return dict(zip(free, table.T, strict=True))
