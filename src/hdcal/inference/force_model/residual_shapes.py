"""Shapes in residuals: a table of columns, and a t test of each."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import special
from scipy.linalg import orth

from hdcal.data.prior import Prior
from hdcal.data.records import Records
from hdcal.inference.distributions import quantiles
from hdcal.inference.force_model.serial_correlation import whitened_products

# Family-wise probability that a shape is found in pure noise.
FALSE_ALARM = 0.01
# Quantiles of the prior of a correlation, and the largest that is tried.
_CORRELATIONS, _CLOSEST = 128, 0.99
_TINY = np.finfo(float).tiny

# Name -> (column, words if positive, words if negative).
Shapes = dict[str, tuple[np.ndarray, str, str]]


@dataclass(frozen=True)
class ResidualFinding:
    """A shape or a fault of the noise, with a p value for all tests made."""

    name: str
    p_value: float
    # Root mean square.
    size_N: float
    words: str
    # Of the shape's column [N], with its standard error.
    coefficient: float = np.nan
    error: float = np.nan


@dataclass(frozen=True)
class Whitened:
    """Residuals (n + p,), sensitivities (n + p, q) and shapes (n + p,), in noise sds.

    Below the rows of the data is one row for each parameter with its prior, so that
    the fit absorbs a shape only as far as the priors let it.
    """

    residual: np.ndarray
    absorbed: np.ndarray
    shapes: Shapes


class Correlated(NamedTuple):
    """Noise whose neighbours may be correlated: previous rows, and a prior."""

    before: np.ndarray
    prior: Prior


class _Test(NamedTuple):
    """A t test of the unit part of a column that the model leaves."""

    name: str
    p_value: float
    coefficient: float
    error: float
    unit: np.ndarray

    def size(self, column: np.ndarray) -> tuple[float, float]:
        """Return the coefficient of the whole column, and its standard error."""
        scale = float(self.unit @ column)
        return self.coefficient / scale, self.error / scale


def shapes_of(
    records: Records, reference_temperature: float, *, smoothed: bool = False
) -> Shapes:
    """Return the shapes to look for in the residuals of these records.

    Where scatter was smoothed out of the deformation, residuals hold it: what the
    deformation leaves of the rows' order and time is then no shape.
    """
    scaled = records.deformation / np.max(np.abs(records.deformation))
    rise = np.asarray(records.temperature) - reference_temperature
    drift = "with temperature: the zero of the reading drifts with it"
    slope = "with temperature in proportion to {displacement}"
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
        "temperature": (rise, f"rise {drift}", f"fall {drift}"),
        "temperature x deformation": (rise * scaled, f"rise {slope}", f"fall {slope}"),
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
    if smoothed:
        del shapes["time"], shapes["order"]
    return {name: shape for name, shape in shapes.items() if np.ptp(shape[0]) > 0.0}


def find_structure(
    data: Whitened, sd: np.ndarray, noise: Correlated | None = None, *, looks: int = 1
) -> tuple[ResidualFinding, ...]:
    """Find the shapes that residuals have beyond what the model can absorb.

    The clearest shape is taken first; the others are then tested on what it leaves,
    each at a family-wise error of `FALSE_ALARM`: Bonferroni over the shapes still
    tried, in all `looks` at them. Coefficients are those of all found shapes together.
    The noise sd of each row is in N.
    """
    shapes, absorbed = dict(data.shapes), data.absorbed
    findings: list[ResidualFinding] = []
    while shapes:
        columns = {name: column for name, (column, _, _) in shapes.items()}
        tests = _tests(data.residual, columns, orthonormal(absorbed), noise)
        if not tests:
            break
        best = min(tests, key=lambda test: test.p_value)
        p = min(1.0, best.p_value * len(tests) * looks)
        if p > FALSE_ALARM:
            break
        column, up, down = shapes.pop(best.name)
        shape = best.coefficient * best.unit[: len(sd)] * sd
        rms = float(np.sqrt(np.mean(shape**2)))
        way = up if best.coefficient > 0.0 else down
        words = f"The residuals {way} ({rms:.2g} {{N}} rms)."
        size = best.size(column)
        findings.append(ResidualFinding(best.name, p, rms, words, *size))
        absorbed = np.column_stack([absorbed, column])
    for index, shape in enumerate(findings if len(findings) > 1 else ()):
        others = [data.shapes[s.name][0] for s in findings if s is not shape]
        basis = orthonormal(np.column_stack([data.absorbed, *others]))
        column = data.shapes[shape.name][0]
        for test in _tests(data.residual, {shape.name: column}, basis, noise):
            size, error = test.size(column)
            findings[index] = replace(shape, coefficient=size, error=error)
    return tuple(findings)


def orthonormal(absorbed: np.ndarray) -> np.ndarray:
    """Return orthonormal columns that span those that are absorbed, (n, q)."""
    scale = np.linalg.norm(absorbed, axis=0)
    columns = absorbed[:, scale > 0.0] / scale[scale > 0.0]
    return orth(columns, rcond=1e-8)


def _tests(
    residual: np.ndarray,
    columns: dict[str, np.ndarray],
    basis: np.ndarray,
    noise: Correlated | None,
) -> list[_Test]:
    """Test each column that the model does not absorb, by generalised least squares.

    Where neighbours may be correlated the p value given ρ is averaged over the
    posterior of ρ with that column in the model: a bend alone resembles correlation.
    There are no tests where too few rows are left. A column whose coefficient leaves
    larger residuals than there were is not in the readings: the noise would have to
    cancel it, which a wrong model of the noise can suggest.
    """
    size, free = basis.shape[1], len(residual) - basis.shape[1] - 1
    units = {}
    for name, column in columns.items():
        rest = column - basis @ (basis.T @ column)
        # Where nearly all of it is absorbed the rest is rounding, not evidence.
        if (length := np.linalg.norm(rest)) > 1e-3 * np.linalg.norm(column):
            units[name] = rest / length
    if free < 1 or not units:
        return []
    error = residual - basis @ (basis.T @ residual)
    table = np.column_stack([basis, *units.values(), error])
    before, rho = np.full(len(residual), -1), np.zeros(1)
    if noise is not None:
        rho = np.minimum(quantiles(noise.prior, _CORRELATIONS), _CLOSEST)
        before = noise.before
    products, log_weight = whitened_products(table, before, rho)
    absorbed, mixed = products[:, :size, :size], products[:, :size, size:]
    rest = products[:, size:, size:] - mixed.mT @ np.linalg.solve(absorbed, mixed)
    log_weight = log_weight - 0.5 * np.linalg.slogdet(absorbed)[1]
    tests = []
    for index, (name, unit) in enumerate(units.items()):
        square, cross = rest[:, index, index], rest[:, index, -1]
        remaining = np.maximum(rest[:, -1, -1] - cross**2 / square, _TINY)
        log_det = np.log(square) + free * np.log(remaining)
        probability = special.softmax(log_weight - 0.5 * log_det)
        sd = np.sqrt(remaining / (free * square))
        t = np.abs(cross) / (square * sd)
        p, coefficient, sd = (
            float(probability @ given_rho)
            for given_rho in (2.0 * special.stdtr(free, -t), cross / square, sd)
        )
        removed = coefficient * (2.0 * float(unit @ error) - coefficient)
        tests.append(_Test(name, p if removed > 0.0 else 1.0, coefficient, sd, unit))
    return tests
