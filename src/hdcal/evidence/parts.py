"""Components at their most probable items, as Gaussian parts of a linear model."""

from collections.abc import Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import log_ndtr

from hdcal.evidence.linear_problem import LinearProblem
from hdcal.evidence.noise_models import NoiseModel


class Context(NamedTuple):
    """A fixed contribution [N] and Gaussian columns [N per sd] that join the base."""

    offset: Float[np.ndarray, " n"]
    columns: Float[np.ndarray, "c n"]


class Part(NamedTuple):
    """One component at its most probable item: offset + columns · a + loose columns.

    Attributes:
        mean: of a, as the item alone has it.
        loose: columns of the shape's tolerance [N per sd].
        one_sided: whether a is not negative.
        shape: index of the point of the shape parameters; −1 without one.
        chord: two amplitudes between which one column is exact.
        place: row and column of the item in a selection; None where it is several.
        spread: log evidence of the component less that of the item, where it was found.
        levels: probability of each tolerance of the shape, with its loose columns.
    """

    component: int
    offset: Float[np.ndarray, " n"]
    columns: Float[np.ndarray, "j n"]
    mean: Float[np.ndarray, " j"]
    sd: Float[np.ndarray, " j"]
    loose: Float[np.ndarray, "l n"]
    shape: int
    place: tuple[int, int] | None
    spread: float
    levels: tuple[tuple[float, Float[np.ndarray, "l n"]], ...]
    one_sided: bool = False
    chord: tuple[float, float] = (0.0, 1.0)

    @property
    def width(self) -> int:
        """Number of Gaussian columns."""
        return len(self.columns) + len(self.loose)

    @property
    def least(self) -> float:
        """The coefficient of the first column at which a is zero."""
        return -float(self.mean[0] / self.sd[0])

    def context(self) -> Context:
        """Return the part as one of the base."""
        columns = np.concatenate([self.sd[:, None] * self.columns, self.loose])
        return Context(self.offset + self.mean @ self.columns, columns)


def merged(parts: Sequence[Part]) -> Part:
    """Return several items of one component as one part; their offsets are zero."""
    columns, mean, sd = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("columns", "mean", "sd")
    )
    return parts[0]._replace(columns=columns, mean=mean, sd=sd, place=None)


class DrawnCurves(NamedTuple):
    """Draws of what the base model leaves of each part [N].

    `whole` has the deviation of the shape; `own` has the shape of the library.
    """

    whole: Float[np.ndarray, "k d n"]
    own: Float[np.ndarray, "k d n"]


def join(problem: LinearProblem, parts: Sequence[Part]) -> Context:
    """Return several parts as one context."""
    none = Context(np.zeros(len(problem.y)), np.zeros((0, len(problem.y))))
    offsets, columns = zip(none, *(part.context() for part in parts), strict=True)
    return Context(np.sum(offsets, axis=0), np.concatenate(columns))


class LinearPosterior(NamedTuple):
    """Gaussian posterior of the coefficients of base and parts, in prior sds.

    The covariance is F'F of `factor` F; `columns` are those of the base and then of the
    parts, `offset` is the fixed contribution of the parts [N].
    """

    mean: Float[np.ndarray, " p"]
    factor: Float[np.ndarray, "p p"]
    columns: Float[np.ndarray, "n p"]
    offset: Float[np.ndarray, " n"]

    @property
    def reading(self) -> Float[np.ndarray, " n"]:
        """Posterior mean of the reading less the prior mean of the base [N]."""
        return self.columns @ self.mean + self.offset


def posterior(
    problem: LinearProblem, noise: NoiseModel, parts: Sequence[Part]
) -> LinearPosterior:
    """Return the posterior of base and parts at the reference noise sd."""
    offset, columns = join(problem, parts)
    columns = np.concatenate([problem.X.T, columns])
    both = np.concatenate([columns, (problem.y - offset)[None]])
    white = problem.whiten(both, noise.weight, noise.correlation) / problem.noise_sd
    precision = white[:-1] @ white[:-1].T + np.eye(len(columns))
    factor = np.linalg.inv(np.linalg.cholesky(precision))
    mean = factor.T @ (factor @ (white[:-1] @ white[-1]))
    return LinearPosterior(mean, factor, columns.T, offset)


def coefficients(problem: LinearProblem, parts: Sequence[Part]) -> list[slice]:
    """Return the place of each part's coefficients in the posterior."""
    ends = problem.X.shape[1] + np.cumsum([0, *(part.width for part in parts)])
    return [slice(start, stop) for start, stop in pairwise(ends)]


def log_sign_probability(
    problem: LinearProblem, noise: NoiseModel, parts: Sequence[Part]
) -> float:
    """Return the log probability that one-sided amplitudes are not negative.

    Parts of a context are Gaussian without bounds. The change of this probability by
    another component restores the bounds.
    """
    if not any(part.one_sided for part in parts):
        return 0.0
    found, total = posterior(problem, noise, parts), 0.0
    for part, place in zip(parts, coefficients(problem, parts), strict=True):
        if part.one_sided:
            sd = np.linalg.norm(found.factor[:, place.start])
            total += float(log_ndtr((found.mean[place.start] - part.least) / sd))
    return total


def sampled_curves(
    problem: LinearProblem,
    noise: NoiseModel,
    parts: Sequence[Part],
    count: int,
    rng: np.random.Generator,
) -> DrawnCurves:
    """Return posterior draws of the parts of a hypothesis."""
    levels = [*product(*(part.levels for part in parts))]
    chance = np.array([np.prod([share for share, _ in each]) for each in levels])
    chance = chance / chance.sum()
    drawn = []
    for each, size in zip(levels, rng.multinomial(count, chance), strict=True):
        if size:
            loose = [
                part._replace(loose=columns)
                for part, (_, columns) in zip(parts, each, strict=True)
            ]
            drawn.append(_drawn(problem, noise, loose, size, rng))
    return DrawnCurves(
        *(np.concatenate(some, axis=1) for some in zip(*drawn, strict=True))
    )


def _drawn(
    problem: LinearProblem,
    noise: NoiseModel,
    parts: Sequence[Part],
    count: int,
    rng: np.random.Generator,
) -> DrawnCurves:
    found, whole, own = posterior(problem, noise, parts), [], []
    normal = rng.standard_normal((count, len(found.mean)))
    draws = found.mean + normal @ found.factor
    for part, place in zip(parts, coefficients(problem, parts), strict=True):
        values = draws[:, place]
        if part.one_sided:
            values[:, 0] = np.maximum(values[:, 0], part.least)
        offset, columns = (problem.project(each) for each in part.context())
        size = len(part.columns)
        own.append(offset + values[:, :size] @ columns[:size])
        whole.append(own[-1] + values[:, size:] @ columns[size:])
    return DrawnCurves(np.stack(whole), np.stack(own))


def mean_curves(
    problem: LinearProblem, noise: NoiseModel, parts: Sequence[Part]
) -> Float[np.ndarray, "k n"]:
    """Return what the base leaves of each part's mean, rows by stated noise."""
    found = posterior(problem, noise, parts)
    curves = [
        part.context().offset + found.columns[:, place] @ found.mean[place]
        for part, place in zip(parts, coefficients(problem, parts), strict=True)
    ]
    return problem.project(np.stack(curves)) * problem.weight
