"""Shapes in residuals: which ones are looked for, and the test that finds them."""

from dataclasses import dataclass

import numpy as np
from scipy import special

from hdcal.data.prior import Prior
from hdcal.data.records import Records
from hdcal.inference.distributions import frozen

# Family-wise probability that pure noise is said to have a shape.
FALSE_ALARM = 0.01
# Correlations that are tried, and the largest: nearer to 1 is as good as that.
_CORRELATIONS, _CLOSEST = 128, 0.99

# Name -> (column, words if positive, words if negative).
Shapes = dict[str, tuple[np.ndarray, str, str]]


@dataclass(frozen=True)
class Structure:
    """One shape that was found in the residuals.

    Attributes:
        name: what they depend on.
        p_value: of the t test, adjusted for the number of shapes tried.
        size_N: RMS of the shape [N].
        words: one sentence for people.
        coefficient: of the shape's column [N]; NaN of what has none.
        error: standard error of it [N].
    """

    name: str
    p_value: float
    size_N: float
    words: str
    coefficient: float = np.nan
    error: float = np.nan


@dataclass(frozen=True)
class Whitened:
    """Residuals and what could explain them, in noise sds.

    Below the rows of the data stands one row for each parameter with its prior, so
    that the fit absorbs a shape only as far as the priors let it.

    Attributes:
        residual: shape (n + p,).
        absorbed: sensitivity to each parameter, shape (n + p, q).
        shapes: what to look for, each column of shape (n + p,).
    """

    residual: np.ndarray
    absorbed: np.ndarray
    shapes: Shapes


@dataclass(frozen=True)
class Correlated:
    """Noise whose neighbours may err alike.

    Attributes:
        before: index of the row before each in its run, −1 for none, shape (n,).
        prior: of their correlation.
    """

    before: np.ndarray
    prior: Prior


def shapes_of(records: Records, reference_temperature: float) -> Shapes:
    """Return the shapes to look for in the residuals of these records."""
    deformation = np.asarray(records.deformation)
    scaled = deformation / np.max(np.abs(deformation))
    rise = np.asarray(records.temperature) - reference_temperature
    shapes: Shapes = {
        "curvature": (
            scaled * np.abs(scaled),
            "bend upwards (convex): the measured {load} grows faster than the model",
            "bend downwards (concave): the measured {load} grows slower than the model",
        ),
        "end": (
            scaled**4,
            "turn up at the largest {displacement}s",
            "turn down at the largest {displacement}s",
        ),
        "direction": (
            np.asarray(records.sense),
            "are higher on loading than on unloading",
            "are lower on loading than on unloading",
        ),
        "temperature": (
            rise,
            "rise with temperature: the zero of the reading drifts with it",
            "fall with temperature: the zero of the reading drifts with it",
        ),
        "temperature x deformation": (
            rise * scaled,
            "rise with temperature in proportion to {displacement}",
            "fall with temperature in proportion to {displacement}",
        ),
        "time": (
            np.asarray(records.time),
            "rise with time since the reset",
            "fall with time since the reset",
        ),
        "order": (
            np.arange(len(scaled), dtype=float),
            "rise from the first row to the last",
            "fall from the first row to the last",
        ),
    }
    return {name: shape for name, shape in shapes.items() if np.ptp(shape[0]) > 0.0}


def find_structure(
    data: Whitened, sd: np.ndarray, noise: Correlated | None = None, *, looks: int = 1
) -> tuple[Structure, ...]:
    """Find the shapes that residuals have beyond what the model can absorb.

    The clearest shape is taken first; the others are then tested on what it leaves.

    Args:
        data: residuals, sensitivities and shapes.
        sd: noise sd of each row [N].
        noise: how neighbours may err alike; None where they do not in the model.
        looks: how often the same shapes are looked for.

    Returns:
        The shapes found, each at a family-wise error of `FALSE_ALARM`, Bonferroni
        over the shapes still tried, in all looks.
    """
    shapes, absorbed = dict(data.shapes), data.absorbed
    found: list[Structure] = []
    while shapes:
        columns = {name: column for name, (column, _, _) in shapes.items()}
        tests = _tests(data.residual, columns, orthonormal(absorbed), noise)
        if not tests:
            break
        p, part, error, left, name = min(tests, key=lambda test: test[0])
        p = min(1.0, p * len(tests) * looks)
        if p > FALSE_ALARM:
            break
        rms = float(abs(part) * np.sqrt(np.mean((left[: len(sd)] * sd) ** 2)))
        column, up, down = shapes.pop(name)
        way = up if part > 0.0 else down
        words = f"The residuals {way} ({rms:.2g} {{N}} rms)."
        # What is left of the column is of unit length.
        length = float(left @ column)
        found.append(Structure(name, p, rms, words, part / length, error / length))
        absorbed = np.column_stack([absorbed, column])
    return tuple(found)


def orthonormal(absorbed: np.ndarray) -> np.ndarray:
    """Return orthonormal columns that span those that are absorbed, (n, q)."""
    scale = np.linalg.norm(absorbed, axis=0)
    columns = absorbed[:, scale > 0.0] / scale[scale > 0.0]
    left, strength, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, strength > 1e-8 * strength[0]]


def _tests(
    residual: np.ndarray,
    columns: dict[str, np.ndarray],
    basis: np.ndarray,
    noise: Correlated | None,
) -> list[tuple[float, float, float, np.ndarray, str]]:
    """Test each column beside what is absorbed, by generalised least squares.

    Where neighbours may err alike the p value is that given ρ, averaged over what the
    data say of ρ with that column in the model: a bend alone passes for correlation.

    Args:
        residual: in noise sds, shape (n,).
        columns: likewise, by name.
        basis: from `orthonormal`.
        noise: how neighbours may err alike.

    Returns:
        p value, coefficient of the unit-length remainder and its standard error, that
        remainder and the name, of what the model does not absorb; nothing where too
        few rows are left.
    """

    def beside(part):
        return part - basis @ (basis.T @ part)

    size, free = basis.shape[1], len(residual) - basis.shape[1] - 1
    rests = {name: beside(column) for name, column in columns.items()}
    units = {
        name: rest / np.linalg.norm(rest)
        for name, rest in rests.items()
        # Nearly all of it is absorbed: the rest is rounding, not evidence.
        if np.linalg.norm(rest) > 1e-3 * np.linalg.norm(columns[name])
    }
    if free < 1 or not units:
        return []
    table = np.column_stack([basis, *units.values(), beside(residual)])
    squares, log_weight = _squares(table, noise)
    held, mixed = squares[:, :size, :size], squares[:, :size, size:]
    left = squares[:, size:, size:] - mixed.mT @ np.linalg.solve(held, mixed)
    log_weight = log_weight - 0.5 * np.linalg.slogdet(held)[1]
    tests = []
    for index, (name, unit) in enumerate(units.items()):
        own, tied = left[:, index, index], left[:, index, -1]
        rest = np.maximum(left[:, -1, -1] - tied**2 / own, np.finfo(float).tiny)
        log_chance = log_weight - 0.5 * (np.log(own) + free * np.log(rest))
        chance = special.softmax(log_chance)
        error = np.sqrt(rest / (free * own))
        p = chance @ (2.0 * special.stdtr(free, -np.abs(tied) / (own * error)))
        part = chance @ (tied / own)
        tests.append((float(p), float(part), float(chance @ error), unit, name))
    return tests


def _squares(
    table: np.ndarray, noise: Correlated | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return products of columns in which noise is independent, (m, k, k), for each ρ.

    And the logarithm of the prior weight of each ρ times the density of its whitening,
    (m,). The sums of whitened rows need those over rows and the rows before them only.
    """
    if noise is None:
        return (table.T @ table)[None], np.zeros(1)
    rho, weight = _correlations(noise.prior)
    (follows,) = np.nonzero(noise.before >= 0)
    own, before = table[follows], table[noise.before[follows]]
    crossed, first = own.T @ before, np.delete(table, follows, axis=0)
    r = rho[:, None, None]
    rows = own.T @ own - r * (crossed + crossed.T) + r**2 * (before.T @ before)
    volume = -0.5 * len(follows) * np.log1p(-(rho**2))
    return first.T @ first + rows / (1.0 - r**2), np.log(weight) + volume


def _correlations(prior: Prior) -> tuple[np.ndarray, np.ndarray]:
    """Return correlations over all of their prior, and the weight of each."""
    if prior.family == "fixed":
        return np.array([float(prior.numbers[0])]), np.ones(1)
    law = frozen(prior)
    ends = np.clip(law.ppf([1e-3, 1.0 - 1e-3]), 0.0, _CLOSEST)
    # Of ρ = tanh² v the prior is smooth in v, see `model`.
    low, high = np.arctanh(np.sqrt(ends))
    v = np.linspace(low, high, _CORRELATIONS + 1)
    v = 0.5 * (v[1:] + v[:-1])
    rho = np.tanh(v) ** 2
    return rho, law.pdf(rho) * np.tanh(v) / np.cosh(v) ** 2
