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


class CoefficientPrior(NamedTuple):
    """A prior of the coefficients of a part, with its probability where it was found.

    `sd` is that of a; `tolerance` is the relative sd of the deviation of the shape.
    """

    probability: float
    sd: Float[np.ndarray, " j"]
    tolerance: float = 0.0


class Part(NamedTuple):
    """One component at its most probable item: offset + columns · a + loose columns.

    Attributes:
        mean: of a, as the item alone has it.
        loose: columns of the shape's tolerance at a relative sd of 1 [N].
        priors: of its coefficients, the most probable first.
        one_sided: whether a is not negative.
        shape: index of the point of the shape parameters; −1 without one.
        chord: two amplitudes between which one column is exact.
        place: row and column of the item in a selection; None where it is several.
        spread: log evidence of the component less that of the item, where it was found.
    """

    component: int
    offset: Float[np.ndarray, " n"]
    columns: Float[np.ndarray, "j n"]
    mean: Float[np.ndarray, " j"]
    loose: Float[np.ndarray, "l n"]
    priors: tuple[CoefficientPrior, ...]
    shape: int
    place: tuple[int, int] | None
    spread: float
    one_sided: bool = False
    chord: tuple[float, float] = (0.0, 1.0)

    @property
    def sd(self) -> Float[np.ndarray, " j"]:
        """Sd of a under the most probable prior."""
        return self.priors[0].sd

    @property
    def width(self) -> int:
        """Number of Gaussian columns."""
        return len(self.columns) + len(self.loose)

    @property
    def least(self) -> float:
        """The coefficient of the first column at which a is zero."""
        return -float(self.mean[0] / self.sd[0])

    def sds(self, prior: CoefficientPrior) -> Float[np.ndarray, " w"]:
        """Return the prior sds of the coefficients of all columns."""
        return np.append(prior.sd, np.full(len(self.loose), prior.tolerance))

    @property
    def unit(self) -> Context:
        """The part at its mean, and all columns at unit size."""
        columns = np.concatenate([self.columns, self.loose])
        return Context(self.offset + self.mean @ self.columns, columns)

    def context(self) -> Context:
        """Return the part under its most probable prior as one of the base."""
        offset, columns = self.unit
        return Context(offset, self.sds(self.priors[0])[:, None] * columns)


def merged(parts: Sequence[Part]) -> Part:
    """Return several items of one component as one part; their offsets are zero."""
    columns, mean, sd = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("columns", "mean", "sd")
    )
    priors = (CoefficientPrior(1.0, sd),)
    return parts[0]._replace(columns=columns, mean=mean, priors=priors, place=None)


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
    products = _products(problem, noise, problem.y - offset, columns)
    mean, factor = _solved(products, np.ones(len(columns)))
    return LinearPosterior(mean, factor, columns.T, offset)


def _products(
    problem: LinearProblem,
    noise: NoiseModel,
    error: Float[np.ndarray, " n"],
    columns: Float[np.ndarray, "p n"],
) -> Float[np.ndarray, "q q"]:
    """Return products of columns and, last, an error in whitened noise variances."""
    both = np.concatenate([columns, error[None]])
    white = problem.whiten(both, noise.weight, noise.correlation) / problem.noise_sd
    return white @ white.T


def _solved(
    products: Float[np.ndarray, "q q"], sd: Float[np.ndarray, " p"]
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, "p p"]]:
    """Return mean and factor as in `LinearPosterior`, given sds of coefficients."""
    precision = sd[:, None] * products[:-1, :-1] * sd + np.eye(len(sd))
    factor = np.linalg.inv(np.linalg.cholesky(precision))
    return factor.T @ (factor @ (sd * products[:-1, -1])), factor


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
    """Return posterior draws of the parts of a hypothesis, over all their priors."""
    draws = _draws(problem, noise, parts, count, rng)
    whole, own = [], []
    for part, place in zip(parts, coefficients(problem, parts), strict=True):
        values, size = draws[:, place], len(part.columns)
        offset, columns = part.unit
        if part.one_sided:
            values[:, 0] = np.maximum(values[:, 0], -part.mean[0])
        curves = problem.project(columns)
        start = problem.project(offset)
        own.append(start + values[:, :size] @ curves[:size])
        whole.append(own[-1] + values[:, size:] @ curves[size:])
    return DrawnCurves(np.stack(whole), np.stack(own))


def _draws(
    problem: LinearProblem,
    noise: NoiseModel,
    parts: Sequence[Part],
    count: int,
    rng: np.random.Generator,
) -> Float[np.ndarray, "d p"]:
    """Return posterior draws of all coefficients, for columns of unit size."""
    offsets, columns = zip(*(part.unit for part in parts), strict=True)
    error = problem.y - np.sum(offsets, axis=0)
    products = _products(problem, noise, error, np.concatenate([problem.X.T, *columns]))
    base, drawn = np.ones(problem.X.shape[1]), []
    priors = [*product(*(part.priors for part in parts))]
    chance = np.array([np.prod([each.probability for each in some]) for some in priors])
    counts = rng.multinomial(count, chance / chance.sum())
    for some, size in zip(priors, counts, strict=True):
        if size:
            sds = [part.sds(prior) for part, prior in zip(parts, some, strict=True)]
            sd = np.concatenate([base, *sds])
            mean, factor = _solved(products, sd)
            normal = rng.standard_normal((size, len(sd)))
            drawn.append(sd * (mean + normal @ factor))
    return np.concatenate(drawn)


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
