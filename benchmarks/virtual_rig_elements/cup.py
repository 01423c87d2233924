"""A thin cylindrical cup between two opposed radial loads, harmonic by harmonic.

Round the cup the displacements are u cos nφ along the axis, v sin nφ around and
w cos nφ outward; along the axis all three are cubic Hermite polynomials, so that
bending without stretching is reproduced and nothing locks. Strains are those of
Sanders, which vanish in rigid motion.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from benchmarks.virtual_rig_elements.banded import assemble_matrix, assemble_vector
from benchmarks.virtual_rig_elements.end import End, end_stiffness

Floats = NDArray[np.floating[Any]]
Base = Literal["clamped", "held", "free"]
Zones = Sequence[tuple[float, float]]

# Of an element's 12 dofs (u, u', v, v', w, w' at either node) those of each.
U, V, W = [0, 1, 6, 7], [2, 3, 8, 9], [4, 5, 10, 11]
# Of the base's 6 dofs; "held" keeps the base round but lets it warp.
FIXED: dict[Base, list[int]] = {"clamped": [0, 2, 4, 5], "held": [2, 4], "free": []}
STIFF = 1e12  # of a support to the wall: errors of its inverse


class Cup(NamedTuple):
    """A cylindrical wall on a base.

    Attributes:
        radius: R of the middle surface [mm].
        length: L from base to rim [mm].
        thickness: δ [mm], or zones (upper end [mm], thickness [mm]) from the base on,
            such as ((50, 0.68), (70, 0.83)) for a tooth band of equal circumferential
            bending stiffness; the last one ends at `length`.
        modulus: Young's modulus E [MPa].
        poisson: Poisson's ratio ν.
        base: an end disc; or "clamped" to a rigid body, "held" round but free to
            warp, "free" as a tube.
    """

    radius: float
    length: float
    thickness: float | Zones
    modulus: float
    poisson: float
    base: Base | End = "clamped"


def cup_stiffness(
    cup: Cup,
    load_height: float,
    *,
    load_length: float = 1.0,
    elements: int = 40,
    harmonics: int = 30,
) -> float:
    """Return the force per radial displacement of one of two opposed loads.

    The load is uniform over a short axial length (less where the cup ends), and the
    displacement is the mean over it: so nothing depends on the mesh at the load.
    Around it is a point; the sum over n = 0, 2, 4, … converges as n⁻³.

    Args:
        cup: wall and base.
        load_height: c of the load's middle above the base [mm].
        load_length: axial length that the load is spread over [mm].
        elements: least number along the axis.
        harmonics: number of terms n = 2, 4, … beside n = 0.

    Returns:
        Stiffness [N/mm].

    Source:
        J. L. Sanders, An improved first-approximation theory for thin shells, NASA
        TR R-24 (1959); O. Zienkiewicz & R. Taylor, The Finite Element Method, vol. 2,
        semi-analytical elements.
    """
    radius, length, thickness, modulus, poisson, base = cup
    zones = ((length, thickness),) if isinstance(thickness, float | int) else thickness
    low = max(load_height - 0.5 * load_length, 0.0)
    high = min(load_height + 0.5 * load_length, length)
    node = _nodes([top for top, _ in zones], (low, high), length, elements)
    delta = _thicknesses(node, zones)
    share = assemble_vector(_mean_deflection(node, low, high))
    compliance = 0.0
    for n in range(0, 2 * harmonics + 1, 2):
        matrix = harmonic_stiffness(n, radius, node, delta, modulus, poisson)
        if isinstance(base, End) and n > 0:
            _join(matrix, end_stiffness(n, radius, base, modulus, poisson))
        _hold(matrix, n, base)
        answer = solveh_banded(matrix, share, check_finite=False)
        # Both loads work on each harmonic.
        compliance += 2.0 * float(share @ answer)
    return 1.0 / compliance


def harmonic_stiffness(
    n: int, radius: float, node: Floats, delta: Floats, modulus: float, poisson: float
) -> Floats:
    """Return the stiffness matrix of one harmonic, all nodes free.

    Args:
        n: waves around the cup; 0 swells and twists it.
        radius: R [mm].
        node: heights of the nodes [mm], shape (elements + 1,).
        delta: thickness of the elements [mm], shape (elements,).
        modulus: E [MPa].
        poisson: ν.

    Returns:
        Upper banded storage, shape (12, 6 (elements + 1)); dofs u, u', v, v', w, w' by
        node.

    Source:
        As `cup_stiffness`.
    """
    point, weight = np.polynomial.legendre.leggauss(4)
    size = np.diff(node)
    strains = _strains(n, radius, 0.5 * (point + 1.0), size)
    plane = np.array([[1.0, poisson, 0.0], [poisson, 1.0, 0.0], [0.0, 0.0, 0.0]])
    plane[2, 2] = 0.5 * (1.0 - poisson)
    # cos² and sin² of nφ both give π R around. At n = 0 cos² gives twice that; twist,
    # which has sin² and so nothing, is kept stiff as no load reaches it.
    around = np.pi * radius * (1.0 if n else 2.0)
    plane *= around * modulus / (1.0 - poisson**2)
    law = np.zeros((len(delta), 6, 6))
    law[:, :3, :3] = delta[:, None, None] * plane
    law[:, 3:, 3:] = (delta**3 / 12.0)[:, None, None] * plane
    area = 0.5 * size[:, None] * weight
    stress = np.einsum("eg,est,egtj->egsj", area, law, strains)
    return assemble_matrix(np.einsum("egsi,egsj->eij", strains, stress))


def _strains(n: int, radius: float, place: Floats, size: Floats) -> Floats:
    """Return εx, εy, γ, κx, κy, 2τ of unit dofs, shape (elements, points, 6, 12)."""
    shape, slope, curve = _hermite(place, size)
    around = n / radius
    strain = np.zeros((*shape.shape[:2], 6, 12))
    strain[..., 0, U] = slope
    strain[..., 1, V] = around * shape
    strain[..., 1, W] = shape / radius
    strain[..., 2, U] = -around * shape
    strain[..., 2, V] = slope
    strain[..., 3, W] = -curve
    strain[..., 4, V] = around / radius * shape
    strain[..., 4, W] = around**2 * shape
    strain[..., 5, U] = 0.5 * around / radius * shape
    strain[..., 5, V] = 1.5 / radius * slope
    strain[..., 5, W] = 2.0 * around * slope
    return strain


def _hermite(place: Floats, size: Floats) -> tuple[Floats, Floats, Floats]:
    """Return cubics of end values and slopes, and two derivatives.

    `place` runs from 0 to 1 in an element; each is of shape (elements, points, 4).
    """
    s, h = place[None, :], size[:, None]
    one = np.ones_like(h * s)
    shape = [1 - 3 * s**2 + 2 * s**3, h * (s - 2 * s**2 + s**3)]
    shape += [3 * s**2 - 2 * s**3, h * (s**3 - s**2)]
    slope = [(6 * s**2 - 6 * s) / h, 1 - 4 * s + 3 * s**2]
    slope += [(6 * s - 6 * s**2) / h, 3 * s**2 - 2 * s]
    curve = [(12 * s - 6) / h**2, (6 * s - 4) / h]
    curve += [(6 - 12 * s) / h**2, (6 * s - 2) / h]
    first, second, third = (
        np.stack([one * term for term in terms], axis=-1)
        for terms in (shape, slope, curve)
    )
    return first, second, third


def _nodes(
    tops: list[float], load: tuple[float, float], length: float, elements: int
) -> Floats:
    """Return nodes no further apart than length/elements, one wherever a step is."""
    if tops != sorted(tops) or tops[-1] != length or load[0] >= load[1]:
        raise ValueError("zones rise to the rim, and the load lies on the cup")
    steps = np.unique([0.0, *tops, *load])
    pieces = [
        np.linspace(a, b, int(np.ceil((b - a) * elements / length - 1e-9)) + 1)[:-1]
        for a, b in pairwise(steps)
    ]
    return np.concatenate([*pieces, [length]])


def _thicknesses(node: Floats, zones: Zones) -> Floats:
    """Return the thickness of each element [mm]."""
    zone = np.searchsorted([top for top, _ in zones[:-1]], 0.5 * (node[:-1] + node[1:]))
    return np.array([thickness for _, thickness in zones])[zone]


def _mean_deflection(node: Floats, low: float, high: float) -> Floats:
    """Return, by element, how its dofs enter the mean of w between two heights."""
    size, middle = np.diff(node), 0.5 * (node[:-1] + node[1:])
    extent = size * ((middle > low) & (middle < high))
    share = np.zeros((len(size), 12))
    share[:, W] = np.column_stack(
        [extent / 2, extent * size / 12, extent / 2, -extent * size / 12]
    )
    return share / extent.sum()


def _join(matrix: Floats, disc: Floats) -> None:
    """Add the end disc to u and w' of the first node; the corner stays square."""
    # Where the wall leans outward by w', the disc's edge leans by f' = −w'.
    matrix[-1, 0] += disc[0, 0]
    matrix[-1, 5] += disc[1, 1]
    matrix[-6, 5] -= disc[0, 1]


def _hold(matrix: Floats, n: int, base: Base | End) -> None:
    """Fix dofs of the first node by a stiff support, which keeps the band."""
    held = set(FIXED["held" if isinstance(base, End) else base])
    if n == 0:
        # Sliding and spinning as a whole, which the loads do not do.
        held |= {0, 2}
    matrix[-1, list(held)] *= STIFF
