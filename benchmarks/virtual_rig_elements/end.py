"""The closed end of a cup: a disc around a rigid hub, bent by the cup's warping."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]


class End(NamedTuple):
    """A flat end, rigid in its plane, flexible out of it.

    Attributes:
        thickness: of the disc [mm].
        hub: radius of the rigid hub that holds the disc [mm].
    """

    thickness: float
    hub: float


def end_stiffness(
    n: int, radius: float, end: End, modulus: float, poisson: float
) -> Floats:
    """Return edge force and moment per edge displacement and slope of one harmonic.

    Out of its plane the disc moves as f(r) cos nφ with f made of r^p,
    p = n, −n, n + 2, 2 − n, and neither moves nor turns at the hub.

    Args:
        n: waves around, at least two.
        radius: R of the edge [mm].
        end: the disc.
        modulus: E [MPa].
        poisson: ν.

    Returns:
        Stiffness of (f, f') at the edge, shape (2, 2), such that half the quadratic
        form is the energy [N mm].

    Source:
        S. Timoshenko & S. Woinowsky-Krieger, Theory of Plates and Shells, ch. 9.
    """
    power = np.array([n, -n, n + 2, 2 - n], float)
    rigidity = modulus * end.thickness**3 / (12.0 * (1.0 - poisson**2))
    hub = end.hub / radius
    # Radii in units of R; each r^p over its largest value, which hub^−n would exceed.
    edge = hub ** np.maximum(-power, 0.0)
    at_hub = hub ** np.maximum(power, 0.0) * np.stack([np.ones(4), power / hub])
    at_edge = edge * np.stack([np.ones(4), power])
    moving = np.linalg.solve(np.vstack([at_hub, at_edge]), np.eye(4)[:, 2:])
    shear = (1 - poisson) * n**2 * (power - 1) - (power**2 - n**2) * (power - 2)
    moment = power * (power - 1) + poisson * (power - n**2)
    matrix = np.pi * rigidity / radius**2 * (edge * np.stack([shear, moment])) @ moving
    units = np.array([1.0, radius])
    return matrix * np.outer(units, units)
