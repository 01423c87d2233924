"""Shapes in residuals: which ones are looked for, and the test that finds them."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from hdcal.data.records import Records

# Family-wise probability that pure noise is said to have a shape.
FALSE_ALARM = 0.01

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
    """

    name: str
    p_value: float
    size_N: float
    words: str


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


def shapes_of(records: Records, reference_temperature: float) -> Shapes:
    """Return the shapes to look for in the residuals of these records."""
    deformation = np.asarray(records.deformation)
    scaled = deformation / np.max(np.abs(deformation))
    rise = np.asarray(records.temperature) - reference_temperature
    shapes: Shapes = {
        "curvature": (
            scaled * np.abs(scaled),
            "bend upwards (convex): the measured force grows faster than the model",
            "bend downwards (concave): the measured force grows slower than the model",
        ),
        "end": (
            scaled**4,
            "turn up at the largest deformations",
            "turn down at the largest deformations",
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
            "rise with temperature in proportion to deformation",
            "fall with temperature in proportion to deformation",
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


def find_structure(data: Whitened, sd: np.ndarray) -> tuple[Structure, ...]:
    """Find the shapes that residuals have beyond what the model can absorb.

    The clearest shape is taken first; the others are then tested on what it leaves.

    Args:
        data: residuals, sensitivities and shapes.
        sd: noise sd of each row [N].

    Returns:
        The shapes found, each at a family-wise error of `FALSE_ALARM`, Bonferroni
        over the shapes still tried.
    """
    shapes, absorbed = dict(data.shapes), data.absorbed
    found: list[Structure] = []
    while shapes:
        basis = orthonormal(absorbed)
        tests = [
            (*test, name)
            for name, (column, _, _) in shapes.items()
            if (test := _test(data.residual, column, basis)) is not None
        ]
        if not tests:
            break
        p, part, left, name = min(tests, key=lambda test: test[0])
        p = min(1.0, p * len(tests))
        if p > FALSE_ALARM:
            break
        rms = float(abs(part) * np.sqrt(np.mean((left[: len(sd)] * sd) ** 2)))
        column, up, down = shapes.pop(name)
        words = f"The residuals {up if part > 0.0 else down} ({rms:.2g} N rms)."
        found.append(Structure(name, p, rms, words))
        absorbed = np.column_stack([absorbed, column])
    return tuple(found)


def orthonormal(absorbed: np.ndarray) -> np.ndarray:
    """Return orthonormal columns that span those that are absorbed, (n, q)."""
    scale = np.linalg.norm(absorbed, axis=0)
    columns = absorbed[:, scale > 0.0] / scale[scale > 0.0]
    left, strength, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, strength > 1e-8 * strength[0]]


def _test(residual, column, left):
    """Test one column; None when the model absorbs it or too few rows are left.

    Args:
        residual: in noise sds, shape (n,).
        column: likewise.
        left: from `orthonormal`.

    Returns:
        p value, coefficient of the unit-length remainder, and that remainder.
    """
    size = np.linalg.norm(column)
    error, column = (part - left @ (left.T @ part) for part in (residual, column))
    free = len(error) - left.shape[1] - 1
    norm = np.linalg.norm(column)
    # Nearly all of it is absorbed: the rest is rounding, not evidence.
    if free < 1 or norm <= 1e-3 * size:
        return None
    column = column / norm
    part = float(column @ error)
    rest = max(float(error @ error) - part**2, np.finfo(float).tiny)
    p = 2.0 * stats.t.sf(abs(part) / np.sqrt(rest / free), free)
    return float(p), part, column
