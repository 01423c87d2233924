"""Minima by Newton's steps within a region in which the expansion can be trusted.

Nocedal and Wright, Numerical Optimization, 2nd ed., algorithm 4.1 with the exact step
of section 4.3, and 6.2 where no Hessian is known. SciPy's `trust-exact` does the same;
to import it takes longer than all steps together.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import jax
import numpy as np

# Value, gradient (d,) and Hessian (d, d) of a function at a point (d,).
Expand: TypeAlias = Callable[
    [np.ndarray], tuple[float | np.ndarray, np.ndarray, np.ndarray]
]
# A step is taken that gains this share of what was expected of it. With less than the
# next the region shrinks, with more than the last it grows.
_TAKEN, _POOR, _GOOD = 0.15, 0.25, 0.75
_MOST_STEPS, _HALVINGS = 300, 60
# A step tells of the curvature whose miss is not so nearly at right angles to it.
_TOLD = 1e-8


class Minimum(NamedTuple):
    """Where a search ended.

    Attributes:
        place: (d,).
        curve: Hessian there, (d, d).
    """

    place: np.ndarray
    curve: np.ndarray


def expansion(function: Callable, point):
    """Return value, gradient and Hessian of a function of (d,), in one pass."""

    def slope(x):
        value, gradient = jax.value_and_grad(function)(x)
        return gradient, (value, gradient)

    hessian, (value, gradient) = jax.jacfwd(slope, has_aux=True)(point)
    # Far out rounding leaves its halves apart, with which a search may fail.
    return value, gradient, 0.5 * (hessian + hessian.T)


def minimise(
    expand: Expand,
    start: np.ndarray,
    tolerance: float,
    *,
    largest: float = 1e4,
    patience: tuple[int, float] | None = None,
) -> Minimum:
    """Search for a minimum; what is not finite counts as infinitely high.

    Args:
        expand: the function.
        start: where to begin, in coordinates in which a step of 1 is no small one.
        tolerance: length of the gradient at which the search ends.
        largest: radius of the region.
        patience: so many steps that gain less than so much end it too: at a bend no
            gradient vanishes.
    """
    place, here = start, _finite(expand(start))
    radius, levels = 1.0, []
    for _ in range(_MOST_STEPS):
        value, slope, curve = here
        if np.linalg.norm(slope) < tolerance:
            break
        step, is_short = _step(slope, curve, radius)
        hoped = -(slope @ step + 0.5 * step @ curve @ step)
        if not hoped > 0.0:
            break
        there = _finite(expand(place + step))
        share = (value - there[0]) / hoped
        if share < _POOR:
            radius *= 0.25
        elif share > _GOOD and not is_short:
            radius = min(2.0 * radius, largest)
        if share > _TAKEN:
            place, here = place + step, there
        levels.append(here[0])
        if patience is not None and len(levels) > patience[0]:
            count, least = patience
            if levels[-1 - count] - levels[-1] < least:
                break
    return Minimum(place, here[2])


class Secant:
    """A function whose Hessian is learned from its gradients, from the identity on.

    Symmetric updates of rank one: steps that were not taken teach it too.
    """

    def __init__(self, function: Callable):
        """Take a function that returns value and gradient (d,)."""
        self._function = function
        self._last: tuple | None = None

    def __call__(self, place: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Return value, gradient and what is known of the Hessian."""
        value, slope = (np.asarray(part, float) for part in self._function(place))
        curve = np.eye(len(place))
        if self._last is not None:
            before, slope_before, curve = self._last
            step = place - before
            missed = slope - slope_before - curve @ step
            along = missed @ step
            if abs(along) > _TOLD * np.linalg.norm(missed) * np.linalg.norm(step):
                curve = curve + np.outer(missed, missed) / along
        if np.isfinite(slope).all():
            self._last = place, slope, curve
        return float(value), slope, curve


def _finite(found) -> tuple[float, np.ndarray, np.ndarray]:
    value, slope, curve = (np.asarray(part, float) for part in found)
    if all(np.isfinite(part).all() for part in (value, slope, curve)):
        return float(value), slope, curve
    return np.inf, np.zeros_like(slope), np.eye(len(slope))


def _step(slope: np.ndarray, curve: np.ndarray, radius: float):
    """Return the lowest point of an expansion within a radius, and if it is inside."""
    strength, axes = np.linalg.eigh(curve)
    along = axes.T @ slope
    if strength[0] > 0.0:
        step = -along / strength
        if np.linalg.norm(step) <= radius:
            return axes @ step, True
    # The curvature is raised by what makes the step as long as the radius.
    low = max(0.0, -strength[0])
    high = low + np.linalg.norm(slope) / radius
    with np.errstate(divide="ignore", invalid="ignore"):
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            is_long = np.linalg.norm(along / (strength + middle)) > radius
            low, high = (middle, high) if is_long else (low, middle)
        step = -along / (strength + high)
    # Where nothing pulls along the axis of least curvature, both ends of it are lowest.
    rest = max(radius**2 - step[1:] @ step[1:], 0.0)
    step[0] = np.copysign(np.sqrt(rest), step[0])
    return axes @ step, False
