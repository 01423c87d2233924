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
        if isinstance(expand, Secant):
            # A step that was not taken has taught it too.
            here = (*here[:2], expand.curve)
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

    By symmetric updates of rank one.

    Attributes:
        curve: what is known of the Hessian, (d, d).
    """

    def __init__(self, function: Callable, size: int):
        """Take a function of (size,) that returns value and gradient."""
        self._function = function
        self._last: tuple[np.ndarray, np.ndarray] | None = None
        self.curve = np.eye(size)

    def __call__(self, place: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Return value, gradient and what is known of the Hessian."""
        value, slope = (np.asarray(part, float) for part in self._function(place))
        if np.isfinite(slope).all():
            if self._last is not None:
                step = place - self._last[0]
                missed = slope - self._last[1] - self.curve @ step
                along = missed @ step
                if abs(along) > _TOLD * np.linalg.norm(missed) * np.linalg.norm(step):
                    self.curve = self.curve + np.outer(missed, missed) / along
            self._last = place, slope
        return float(value), slope, self.curve


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
    # Where nothing pulls, nothing moves, however little holds it there.
    pulled = along != 0.0

    def raised(by) -> np.ndarray:
        with np.errstate(divide="ignore"):
            return np.divide(-along, strength + by, out=0.0 * along, where=pulled)

    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        is_long = np.linalg.norm(raised(middle)) > radius
        low, high = (middle, high) if is_long else (low, middle)
    step = raised(high)
    # Where nothing pulls along the axis of least curvature, both ends of it are lowest.
    rest = max(radius**2 - step[1:] @ step[1:], 0.0)
    step[0] = np.copysign(np.sqrt(rest), step[0])
    return axes @ step, False
