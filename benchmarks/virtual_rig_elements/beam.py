"""The corotational beam: small strains seen from a chord that moves at will."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.virtual_rig_elements.banded import assemble_matrix, assemble_vector

Floats = NDArray[np.floating[Any]]


class Beams(NamedTuple):
    """A chain of straight two-node Bernoulli beams at rest.

    Attributes:
        chord: vector from node to node [mm], shape (elements, 2).
        axial: EA [N], shape (elements,).
        bending: EI [N mm²], shape (elements,).
    """

    chord: Floats
    axial: Floats
    bending: Floats


class ChainState(NamedTuple):
    """Energy, forces and tangent of the displaced chain.

    Attributes:
        energy: strain energy [N mm].
        force: nodal forces and moments, shape (3 nodes,).
        tangent: derivative of `force`, upper banded storage, shape (6, 3 nodes).
    """

    energy: float
    force: Floats
    tangent: Floats


def respond(beams: Beams, state: Floats) -> ChainState:
    """Return energy, forces and tangent of displaced and rotated nodes.

    Args:
        beams: the chain at rest.
        state: displacements x, y [mm] and rotation [rad], shape (nodes, 3).

    Returns:
        Energy, nodal forces and tangent.

    Source:
        M. Crisfield, Non-linear Finite Element Analysis of Solids and Structures,
        vol. 1, sec. 7.3.
    """
    rest = np.hypot(*beams.chord.T)
    moved = np.diff(state[:, :2], axis=0)
    chord = beams.chord + moved
    length = np.hypot(*chord.T)
    # Differences of displacements, not of positions: exact to the last digit where
    # the ring hardly moves.
    stretch = np.sum((2.0 * beams.chord + moved) * moved, axis=1) / (length + rest)
    turn = np.arctan2(
        beams.chord[:, 0] * moved[:, 1] - beams.chord[:, 1] * moved[:, 0],
        np.sum(beams.chord * chord, axis=1),
    )
    bend = np.column_stack([state[:-1, 2], state[1:, 2]]) - turn[:, None]

    normal = beams.axial * stretch / rest
    rigidity = beams.bending / rest
    moment = rigidity[:, None] * (4.0 * bend + 2.0 * bend[:, ::-1])
    energy = 0.5 * np.sum(normal * stretch) + 0.5 * np.sum(moment * bend)

    along, across = _directions(chord / length[:, None])
    turning = across / length[:, None]
    modes = np.stack([along, -turning, -turning], axis=1)
    modes[:, 1, 2] += 1.0
    modes[:, 2, 5] += 1.0
    inner = np.column_stack([normal, moment])
    force = np.einsum("em,emi->ei", inner, modes)
    return ChainState(
        float(energy),
        assemble_vector(force),
        assemble_matrix(
            _material(modes, beams.axial / rest, rigidity)
            + _geometric(along, turning, length, inner)
        ),
    )


def _directions(unit: Floats) -> tuple[Floats, Floats]:
    """Return how stretch, and shift across the chord, follow from the 6 dofs."""
    cos, sin = unit.T
    none = np.zeros_like(cos)
    along = np.column_stack([-cos, -sin, none, cos, sin, none])
    across = np.column_stack([sin, -cos, none, -sin, cos, none])
    return along, across


def _material(modes: Floats, axial: Floats, rigidity: Floats) -> Floats:
    """Return the tangent at fixed directions."""
    local = np.zeros((len(axial), 3, 3))
    local[:, 0, 0] = axial
    local[:, 1:, 1:] = rigidity[:, None, None] * np.array([[4.0, 2.0], [2.0, 4.0]])
    return np.swapaxes(modes, 1, 2) @ local @ modes


def _geometric(along: Floats, turning: Floats, length: Floats, inner: Floats) -> Floats:
    """Return the tangent of turning directions under the inner forces."""
    normal, moments = inner[:, 0], inner[:, 1] + inner[:, 2]
    pull = (normal * length)[:, None, None] * (
        turning[:, :, None] * turning[:, None, :]
    )
    mixed = along[:, :, None] * turning[:, None, :]
    shear = (moments / length)[:, None, None] * (mixed + np.swapaxes(mixed, 1, 2))
    return pull + shear
