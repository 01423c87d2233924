"""A ring of corotational beams between two opposed radial loads.

Straight two-node Bernoulli beams on a circle, each with its own thickness: the chord
carries any displacement and rotation, the strains seen from the chord stay small. The
beams' centre lines lie on one circle, so that the step of the centre line at a tooth
is left out.
"""

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import LinAlgError, solveh_banded

from benchmarks.virtual_rig_elements.banded import multiply
from benchmarks.virtual_rig_elements.beam import Beams, ChainState, respond
from hdcal.errors import NotUsable

Floats = NDArray[np.floating[Any]]

LARGEST_STEP = 0.02  # of the radius; Newton's region of convergence with room
MOST_ITERATIONS = 30


class Ring(NamedTuple):
    """A ring between two opposed radial loads, and how it is meshed.

    Attributes:
        radius: R of the centre line [mm].
        thickness: δ [mm], one number, or one per element counted from the load.
        length: axial width L [mm]; EA = E L δ, EI = E L δ³/12.
        modulus: Young's modulus E [MPa].
        elements: number of elements where `thickness` is one number.
        part: what is meshed. "quarter" for thickness symmetric about both diameters,
            "half" for symmetry about the line of the loads only.
    """

    radius: float
    thickness: ArrayLike
    length: float
    modulus: float
    elements: int = 40
    part: Literal["quarter", "half"] = "quarter"


class _Mesh(NamedTuple):
    """A part of the ring, from the load on; nodes (x, y, rotation), the load on y."""

    beams: Beams
    free: slice  # of the dofs
    copies: int  # how many of this part make the ring


def load_curve(ring: Ring, displacement: ArrayLike) -> Floats:
    """Return the force at either load for imposed radial displacements.

    Args:
        ring: the ring and its mesh.
        displacement: ω of one load towards the centre [mm], shape (points,); negative
            pulls. Half the change of diameter.

    Returns:
        Force F [N], shape (points,), with the sign of the displacement.

    Raises:
        NotUsable: the ring is not stable there, or Newton's iteration failed.

    Source:
        M. Crisfield, Non-linear Finite Element Analysis of Solids and Structures,
        vol. 1, sec. 7.3 (corotational beam).
    """
    return np.array([_load(state.force) for state in _equilibria(ring, displacement)])


def strain_energy(ring: Ring, displacement: ArrayLike) -> Floats:
    """Return the energy U [N mm] of the whole ring; two loads work, so 2 F = dU/dω.

    Arguments, errors and source as in `load_curve`.
    """
    energies = [state.energy for state in _equilibria(ring, displacement)]
    return _mesh(ring).copies * np.array(energies)


def stiffness(ring: Ring) -> float:
    """Return dF/dω [N/mm] of the undeformed ring.

    Thin and inextensible it is π E L δ³/(24 R³ S), S = (π² − 8)/16.

    Source:
        As `load_curve`; the closed form from S. Timoshenko, Strength of Materials.
    """
    mesh = _mesh(ring)
    tangent = respond(mesh.beams, _at_rest(mesh)).tangent
    return _load(multiply(tangent, _unit_press(mesh, tangent).ravel()))


def toothed_wall(
    wall: float, height: float, teeth: int, *, share: float = 0.5, per_tooth: int = 4
) -> Floats:
    """Return the thickness along a quarter ring with teeth, a tooth at the load.

    Args:
        wall: thickness δ under the teeth [mm].
        height: tooth height [mm].
        teeth: number on the whole ring, a multiple of four.
        share: of the pitch that a tooth takes, in steps of 2/per_tooth.
        per_tooth: elements per pitch.

    Returns:
        Thickness [mm], shape (teeth · per_tooth / 4,).

    Source:
        A tooth is a thicker piece of beam: an upper bound of what it stiffens, since
        the corners of a real tooth carry no bending stress.
    """
    if teeth % 4 or abs((0.5 * share * per_tooth + 0.5) % 1.0 - 0.5) > 1e-9:
        raise ValueError("teeth come in fours, their halves in whole elements")
    pitches = (np.arange(teeth * per_tooth // 4) + 0.5) / per_tooth
    on_tooth = np.abs(pitches - np.round(pitches)) < 0.5 * share
    return wall + height * on_tooth


def _mesh(ring: Ring) -> _Mesh:
    delta = np.asarray(ring.thickness, float)
    delta = np.full(ring.elements, delta) if delta.ndim == 0 else delta
    axial, bending = _sections(delta, ring.length, ring.modulus)
    arc = np.pi / 2.0 if ring.part == "quarter" else np.pi
    angle = np.linspace(0.0, arc, len(delta) + 1)
    node = ring.radius * np.column_stack([np.sin(angle), np.cos(angle)])
    # On the unloaded diameter the far node slides in x; at the other load it is held.
    last = 3 * len(delta)
    quarter = ring.part == "quarter"
    free, copies = (slice(3, last + 1), 4) if quarter else (slice(3, last), 2)
    return _Mesh(Beams(np.diff(node, axis=0), axial, bending), free, copies)


def _at_rest(mesh: _Mesh) -> Floats:
    return np.zeros((len(mesh.beams.axial) + 1, 3))


def _sections(delta: Floats, length: float, modulus: float) -> tuple[Floats, Floats]:
    """Return EA [N] and EI [N mm²] of rectangular sections."""
    return modulus * length * delta, modulus * length * delta**3 / 12.0


def _equilibria(ring: Ring, displacement: ArrayLike) -> Iterator[ChainState]:
    """Yield the chain at each displacement, walking from one to the next."""
    mesh, radius = _mesh(ring), ring.radius
    state, reached = _at_rest(mesh), 0.0
    chain = respond(mesh.beams, state)
    for target in np.atleast_1d(np.asarray(displacement, float)):
        steps = int(np.ceil(abs(target - reached) / (LARGEST_STEP * radius)))
        for goal in np.linspace(reached, target, steps + 1)[1:]:
            # Pressing along the tangent first keeps the jump out of the element at
            # the load, where it would be a large stretch.
            state = state + (goal - reached) * _unit_press(mesh, chain.tangent)
            state, chain = _newton(mesh, state, radius)
            reached = goal
        yield chain


def _newton(mesh: _Mesh, state: Floats, radius: float) -> tuple[Floats, ChainState]:
    """Return the balanced state and its response; imposed dofs stay as they are."""
    for _ in range(MOST_ITERATIONS):
        response = respond(mesh.beams, state)
        correction = np.zeros(state.size)
        correction[mesh.free] = -_solve(mesh, response.tangent, response.force)
        state = state + correction.reshape(state.shape)
        # Quadratic convergence: after a correction this small there is nothing left.
        if np.max(np.abs(correction)) < 1e-9 * min(radius, 1.0):
            return state, respond(mesh.beams, state)
    raise NotUsable(f"no equilibrium of the ring within {MOST_ITERATIONS} iterations")


def _unit_press(mesh: _Mesh, tangent: Floats) -> Floats:
    """Return how the nodes move per radial displacement of the loads [mm/mm]."""
    press = np.zeros((tangent.shape[1] // 3, 3))
    press[0, 1] = -1.0
    if mesh.copies == 2:
        press[-1, 1] = 1.0
    flat = press.ravel()
    flat[mesh.free] = -_solve(mesh, tangent, multiply(tangent, flat))
    return press


def _solve(mesh: _Mesh, tangent: Floats, force: Floats) -> Floats:
    # The free dofs are neighbours, so that their band is a piece of the whole one.
    band = tangent[:, mesh.free]
    try:
        return solveh_banded(band, force[mesh.free], check_finite=False)
    except LinAlgError as error:
        raise NotUsable("the ring is not stable at this displacement") from error


def _load(force: Floats) -> float:
    """Return F: the line of the loads cuts the ring, so each side carries F/2."""
    return -2.0 * float(force[1])
