"""The linear-Gaussian core updated row by row: exact, and in constant memory.

Readings y = x·β + e, e ~ N(0, σ²), with β | σ² ~ N(m, σ² L Lᵀ) and σ² inverse gamma
with shape a and rate b. In the coordinates β = m + L u all that the rows said is a
triangular factor: R u ≈ z, one Givens rotation per coefficient and row. Unlike an
update of the covariance this loses no digits, whatever the rows are like.
"""

from dataclasses import dataclass
from math import copysign, hypot, inf, sqrt

import numpy as np
from scipy.optimize import root_scalar
from scipy.special import digamma, ndtri, polygamma, stdtr, stdtrit

# Directions of relative variance below this were never free, as with a fixed prior.
_NO_VARIANCE = 1e-13
_MOST_SHAPE = 1e8
# What is forgotten fades to the start with its sds this many times as wide: a gear
# that has changed is not held to what it was.
_FADED = 10.0
LEVEL = 0.95
# A normal score beyond this has no probability left in double precision.
_FARTHEST = 37.0


@dataclass(frozen=True)
class Start:
    """What is known of coefficients and noise before the first row.

    Attributes:
        mean: m, shape (p,).
        root: L, shape (p, r); what cannot vary has no column.
        shape: a [-].
        rate: b [N²].
    """

    mean: np.ndarray
    root: np.ndarray
    shape: float
    rate: float


def match(coefficients: np.ndarray, variance: np.ndarray) -> Start:
    """Return the normal-inverse-gamma law with the moments of draws.

    Mean and covariance of the coefficients are those of the draws, mean and variance
    of log σ² likewise; that σ² and coefficients depend on each other, and any skew,
    is lost.

    Args:
        coefficients: of the linear columns, shape (draw, p).
        variance: σ² of a reading [N²], shape (draw,).
    """
    logs = np.log(variance)
    return start_from(
        np.mean(coefficients, axis=0),
        np.cov(coefficients, rowvar=False),
        float(np.mean(logs)),
        float(np.var(logs)),
    )


def start_from(
    mean: np.ndarray, covariance: np.ndarray, log_mean: float, log_variance: float
) -> Start:
    """Return the normal-inverse-gamma law with these moments.

    Args:
        mean: of the coefficients, shape (p,).
        covariance: of the coefficients, shape (p, p).
        log_mean: of log σ².
        log_variance: of log σ².
    """
    shape = _shape(log_variance)
    rate = float(np.exp(log_mean + digamma(shape)))
    # The mean of σ², where it has one that says something.
    over = covariance / (rate / (shape - 1.0) if shape > 2.0 else rate / shape)
    sd = np.sqrt(np.diag(over))
    unit = np.where(sd > 0.0, sd, 1.0)
    values, vectors = np.linalg.eigh(over / np.outer(unit, unit))
    free = values > _NO_VARIANCE
    root = unit[:, None] * vectors[:, free] * np.sqrt(values[free])
    return Start(mean, root, shape, rate)


def _shape(spread: float) -> float:
    """Return the shape a whose log has this variance: ψ′(a) = spread."""

    def excess(log_shape: float) -> float:
        return float(polygamma(1, np.exp(log_shape))) - spread

    if spread <= 1.0 / _MOST_SHAPE:
        return _MOST_SHAPE
    ends = (np.log(1e-6), np.log(10.0 * _MOST_SHAPE))
    return float(np.exp(root_scalar(excess, bracket=ends).root))


def normal_score(t: float, freedom: float) -> float:
    """Return the standard normal score with the probability of a Student one."""
    score = -float(ndtri(stdtr(freedom, -abs(t))))
    return copysign(min(score, _FARTHEST), t)


def mixture_score(below: float, above: float) -> float:
    """Return the standard normal score of a reading with these tail probabilities."""
    # The smaller tail still has its digits.
    score = float(ndtri(below)) if below < above else -float(ndtri(above))
    return max(-_FARTHEST, min(_FARTHEST, score))


def half_width(freedom: float) -> float:
    """Return half of the interval that holds 95 % of a Student law, in scales."""
    return float(stdtrit(freedom, 0.5 + LEVEL / 2.0))


def student_sd(scale: float, freedom: float) -> float:
    """Return the sd of a Student law; below two degrees of freedom it has none."""
    return scale * sqrt(freedom / (freedom - 2.0)) if freedom > 2.0 else inf


class LinearCore:
    """Knowledge of the linear coefficients, updated by one row after another.

    Plain floats: on two to four coefficients they beat array libraries by far.

    Args:
        start: what is known before the first row.
        forget: share λ of what is known that is kept at each new row; below 1 the
            knowledge is tempered towards a start ten times as wide, p ← p^λ · p₀^(1−λ)
            (stabilised forgetting, Kulhavý and Zarrop 1993).
    """

    # Where the zero of the force stands among the linear columns.
    zero = 2

    def __init__(self, start: Start, forget: float = 1.0):
        size = start.root.shape[1]
        self._mean = start.mean.tolist()
        self._root = start.root.tolist()
        self._begin = (start.shape, start.rate)
        self._forget = forget
        self.factor = [[float(i == j) for j in range(size)] for i in range(size)]
        self.target = [0.0] * size
        self.shape, self.rate = start.shape, start.rate
        self._now = [0.0] * size

    def step(self, columns: list[float], force: float) -> tuple[float, float, float]:
        """Predict a row from the rows before it, then learn from it.

        Args:
            columns: x.
            force: reading y [N].

        Returns:
            Median [N] and half-width of the 95 % interval [N] of the predictive
            distribution, a Student one, and the normal score of the reading in it.
        """
        if self._forget < 1.0:
            self._fade()
        size = range(len(self.target))
        middle, row = 0.0, [0.0] * len(self.target)
        for x, mean, part in zip(columns, self._mean, self._root, strict=True):
            middle += x * mean
            for i in size:
                row[i] += x * part[i]
        left = force - middle
        expected = middle + sum(map(float.__mul__, row, self._now))
        scale = sqrt(self.rate / self.shape * (1.0 + self._squares(row)))
        freedom = 2.0 * self.shape
        score = normal_score((force - expected) / scale, freedom)
        rest = self._insert(row, left)
        self.shape += 0.5
        self.rate += 0.5 * rest * rest
        self._now = self._solve()
        return expected, scale * half_width(freedom), score

    def coefficient(self, index: int) -> tuple[float, float, float]:
        """Return mean, sd and half-width of the 95 % interval of a coefficient."""
        part = self._root[index]
        middle = self._mean[index] + sum(map(float.__mul__, part, self._now))
        scale = sqrt(self.rate / self.shape * self._squares(part))
        freedom = 2.0 * self.shape
        return middle, student_sd(scale, freedom), scale * half_width(freedom)

    def moments(self) -> tuple[np.ndarray, np.ndarray]:
        """Return mean, and covariance over σ², of all coefficients."""
        root, mean = np.array(self._root), np.array(self._mean)
        back = np.linalg.solve(np.array(self.factor).T, root.T)
        return mean + root @ np.array(self._now), back.T @ back

    def widen(self, index: int, variance: float) -> None:
        """Add variance to one coefficient: it may have moved since the last row.

        Args:
            index: of the coefficient.
            variance: to add, in the square of its unit.
        """
        root = np.array(self._root)
        direction = np.linalg.lstsq(root, np.eye(len(root))[index], rcond=None)[0]
        inverse = np.linalg.inv(np.array(self.factor))
        spread = inverse @ inverse.T
        ratio = variance / (self.rate / self.shape)
        spread += ratio * np.outer(direction, direction)
        # R is only fixed up to a rotation: bring it back to a triangle.
        factor = np.linalg.qr(np.linalg.inv(np.linalg.cholesky(spread))).R
        self.factor = factor.tolist()
        self.target = (factor @ np.array(self._now)).tolist()

    def _insert(self, row: list[float], left: float) -> float:
        """Rotate a row into the triangle; its remainder is what no u explains."""
        target, size = self.target, len(row)
        for i, line in enumerate(self.factor):
            x, d = row[i], line[i]
            if x == 0.0:
                continue
            h = hypot(d, x)
            c, s = d / h, x / h
            line[i] = h
            for j in range(i + 1, size):
                old, new = line[j], row[j]
                line[j] = c * old + s * new
                row[j] = c * new - s * old
            old = target[i]
            target[i] = c * old + s * left
            left = c * left - s * old
        return left

    def _solve(self) -> list[float]:
        """Return the u with R u = z."""
        size = len(self.target)
        found = [0.0] * size
        for i in range(size - 1, -1, -1):
            line, total = self.factor[i], self.target[i]
            for j in range(i + 1, size):
                total -= line[j] * found[j]
            found[i] = total / line[i]
        return found

    def _squares(self, row: list[float]) -> float:
        """Return rowᵀ (Rᵀ R)⁻¹ row."""
        factor, total, found = self.factor, 0.0, []
        for i, value in enumerate(row):
            for j in range(i):
                value -= factor[j][i] * found[j]
            value /= factor[i][i]
            found.append(value)
            total += value * value
        return total

    def _fade(self) -> None:
        """Temper towards the wide start: a multiple of one, with the target zero."""
        keep, size = self._forget, len(self.target)
        less, anew = sqrt(keep), sqrt(1.0 - keep) / _FADED
        self.factor = [[less * value for value in line] for line in self.factor]
        self.target = [less * value for value in self.target]
        for i in range(size):
            self._insert([anew * (i == j) for j in range(size)], 0.0)
        shape, rate = self._begin
        self.shape = keep * self.shape + (1.0 - keep) * shape
        self.rate = keep * self.rate + (1.0 - keep) * rate
        self._now = self._solve()
