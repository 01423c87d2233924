"""Where an effect is computed: quantiles of its shapes, cells of its amplitude."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from hdcal.data.priors import Prior
from hdcal.inference.distributions import frozen, moments
from hdcal.physics.effect import Effect, parameters

# Quantiles of a shape parameter; with several, the number of each. An effect that is
# not linear in its amplitude has many cells at each of them, and gets fewer.
SHAPE_POINTS = {"linear": (25, 7, 4), "cells": (7, 4, 3), "subspace": (31, 5, 3)}
# Edges of the amplitude's cells reach from the first to the last, in prior sds.
SMALLEST, LARGEST = 1.0 / 64.0, 64.0
# Ratio of neighbouring edges: an effect that is linear in its amplitude needs cells
# only because the tolerance of its shape grows with it.
COARSE, FINE = 2.0, 2.0**0.5
# How much narrower or wider than stated the prior of a zero-centred amplitude may be,
# and with which probability: sizes on a rig are known to a factor of some only, and
# small ones are as ordinary as large ones.
SCALES = np.array([0.1, 1.0 / 3.0, 1.0, 3.0, 10.0])
SCALE_WEIGHTS = np.array([0.15, 0.2, 0.3, 0.2, 0.15])


@dataclass(frozen=True)
class ParameterGrid:
    """Shape points and amplitude cells of one effect.

    Attributes:
        effect: the effect.
        amplitudes: names of its amplitudes; several only where it is linear in them.
        shapes: values of the shape parameters at each shape point, by name.
        edges: increasing edges of the amplitude's cells, shape (c + 1,).
        mean: of the amplitude's prior.
        sd: of the amplitude's prior.
        normal: the prior is normal, or half of one; else cells are filled evenly.
        one_sided: the prior is half normal.
        mass: of each cell where the prior is not normal.
    """

    effect: type[Effect]
    amplitudes: tuple[str, ...]
    shapes: dict[str, np.ndarray]
    edges: np.ndarray
    mean: float
    sd: float
    normal: bool
    one_sided: bool
    mass: np.ndarray

    @property
    def size(self) -> int:
        """Number of shape points."""
        return len(next(iter(self.shapes.values()))) if self.shapes else 1

    def one_amplitude_each(
        self, shapes: Mapping[str, np.ndarray]
    ) -> dict[str, np.ndarray]:
        """Return values in which one amplitude after the other is its prior sd.

        Args:
            shapes: values of the shape parameters, by name, each of shape (s,).

        Returns:
            Of shape (s · number of amplitudes,) each; the amplitudes change first.
        """
        count = len(self.amplitudes)
        points = len(next(iter(shapes.values()))) if shapes else 1
        values = {name: np.repeat(value, count) for name, value in shapes.items()}
        for index, name in enumerate(self.amplitudes):
            values[name] = np.tile(self.sd * np.eye(count)[index], points)
        return values

    @property
    def centred(self) -> bool:
        """Whether a wider prior is only a matter of scale."""
        return self.normal and self.mean == 0.0


def make_grid(
    effect: type[Effect],
    priors: Mapping[str, Prior],
    ratio: float = COARSE,
    kind: str = "linear",
) -> ParameterGrid:
    """Return the points and cells of one effect.

    Args:
        effect: of the library.
        priors: by site name, `effect.parameter`.
        ratio: of neighbouring amplitude edges.
        kind: of `SHAPE_POINTS`.
    """
    own = {name: priors[f"{effect.name}.{name}"] for name in parameters(effect)}
    amplitudes = tuple(n for n, p in parameters(effect).items() if p.null is not None)
    prior = own[amplitudes[0]]
    free = {n: p for n, p in own.items() if n not in amplitudes}
    edges = amplitude_edges(prior, ratio)
    mass = np.ones(len(edges) - 1)
    normal = prior.family in ("normal", "half_normal")
    if not normal:
        mass = np.diff(frozen(prior).cdf(edges))
    return ParameterGrid(
        effect=effect,
        amplitudes=amplitudes,
        shapes=_shape_points(free, SHAPE_POINTS[kind]),
        edges=edges,
        mean=float(prior.numbers[0]) if prior.family == "normal" else 0.0,
        sd=moments(prior)[1] if not normal else float(prior.numbers[-1]),
        normal=normal,
        one_sided=prior.family == "half_normal",
        mass=mass,
    )


def _shape_points(
    free: Mapping[str, Prior], points: tuple[int, ...]
) -> dict[str, np.ndarray]:
    varied = sum(prior.family != "fixed" for prior in free.values())
    count = points[min(max(varied, 1), len(points)) - 1]
    return quantile_grid(free, dict.fromkeys(free, count))


def quantile_grid(
    priors: Mapping[str, Prior], counts: Mapping[str, int]
) -> dict[str, np.ndarray]:
    """Return all combinations of equally probable values of several parameters.

    Args:
        priors: of each parameter, by name.
        counts: values of each; a fixed parameter has one.

    Returns:
        Values of each parameter at all points, all of one length.
    """
    axes = []
    for name, prior in priors.items():
        quantiles = (np.arange(counts[name]) + 0.5) / counts[name]
        fixed = prior.family == "fixed"
        axes.append(prior.numbers[:1] if fixed else frozen(prior).ppf(quantiles))
    table = np.array(list(product(*axes)), float)
    return dict(zip(priors, table.T, strict=True))


def amplitude_edges(prior: Prior, ratio: float) -> np.ndarray:
    """Return the edges of the amplitude's cells, up to far beyond its prior."""
    count = round(np.log(LARGEST / SMALLEST) / np.log(ratio))
    steps = np.concatenate([[0.0], np.geomspace(SMALLEST, LARGEST, count + 1)])
    match prior.family:
        case "half_normal":
            return steps * float(prior.numbers[0])
        case "normal":
            mean, sd = map(float, prior.numbers)
            return mean + sd * np.concatenate([-steps[:0:-1], steps])
        case "fixed":
            raise ValueError("the amplitude of an effect cannot be fixed")
    law = frozen(prior)
    return np.unique(
        law.ppf(np.concatenate([[1e-6], np.linspace(0.02, 0.98, 25), [1 - 1e-6]]))
    )
