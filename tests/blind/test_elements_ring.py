"""The ring of beams answers as theory says, at the rate its elements promise."""

from collections.abc import Callable

import numpy as np
import pytest
from benchmarks.virtual_rig_elements import ring
from benchmarks.virtual_rig_elements.ring import (
    Ring,
    load_curve,
    stiffness,
    strain_energy,
    toothed_wall,
)
from scipy import integrate

from hdcal.errors import NotUsable

R, WALL, LENGTH, E = 40.0, 0.68, 70.0, 210e3
PLAIN = Ring(R, WALL, LENGTH, E)
MESHES = np.array([10, 20, 40, 80])


def thin_ring(wall: float) -> float:
    """π E L δ³/(24 R³ S), S = (π² − 8)/16."""
    return np.pi * E * LENGTH * wall**3 / (24 * R**3 * (np.pi**2 - 8) / 16)


def stretching_ring(wall: float) -> float:
    """The same by Castigliano with the work of the normal force, π F R/(4 E A)."""
    bending = (np.pi / 4 - 2 / np.pi) * R**3 * 12 / (E * LENGTH * wall**3)
    return 2.0 / (bending + np.pi / 4 * R / (E * LENGTH * wall))


def assert_second_order(error: Callable[[int], float], within: float) -> None:
    """Halving the elements quarters the error, down to `within`."""
    errors = np.abs([error(m) for m in MESHES])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < within


def linear_error(elements: int) -> float:
    return stiffness(PLAIN._replace(elements=elements)) / stretching_ring(WALL) - 1


def elastica(pressed: float) -> float:
    """Return F R²/EI of the inextensible ring pressed by `pressed` R, a quarter of it.

    Arc s from the load on, tangent at angle θ: the curvature is −1/R + M/EI, and the
    cut carries F/2 along the line of the loads, so that dM/ds = −(F/2) cos θ.
    """

    def rates(s, state, load):
        _, _, angle, moment = state
        half = 0.5 * load[0] * np.cos(angle)
        return np.stack([np.cos(angle), np.sin(angle), moment - 1.0, -half])

    def ends(near, far, load):
        held = [near[0], near[1] - 1.0 + pressed, near[2], far[1], far[2] + np.pi / 2]
        return np.array(held)

    arc = np.linspace(0.0, np.pi / 2, 41)
    guess = np.stack([np.sin(arc), np.cos(arc), -arc, np.zeros_like(arc)])
    start = [2.0 * pressed / 0.14878]
    solved = integrate.solve_bvp(rates, ends, arc, guess, start, tol=1e-9)
    assert solved.success
    return float(solved.p[0])


def test_the_plain_ring_is_castiglianos_with_second_order():
    assert_second_order(linear_error, within=1e-4)
    # What the stretch leaves is of the order of the wall over the radius, squared.
    assert stretching_ring(WALL) == pytest.approx(thin_ring(WALL), rel=2e-4)


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_a_wrong_moment_of_inertia_breaks_the_convergence(factor, monkeypatch):
    right = ring._sections

    def wrong(*arguments):
        axial, bending = right(*arguments)
        return axial, factor * bending

    monkeypatch.setattr(ring, "_sections", wrong)
    with pytest.raises(AssertionError):
        assert_second_order(linear_error, within=1e-4)


@pytest.mark.parametrize("pressed", [-0.1, 0.02, 0.1, 0.25])
def test_large_displacements_are_the_elasticas_with_second_order(pressed):
    # So thin that its stretch is below the error of the finest mesh.
    wall = 0.05
    rigidity = E * LENGTH * wall**3 / 12.0
    exact = elastica(pressed) * rigidity / R**2

    def error(elements: int) -> float:
        force = load_curve(Ring(R, wall, LENGTH, E, elements), pressed * R)
        return float(force[0] / exact - 1.0)

    assert_second_order(error, within=2e-4)


@pytest.mark.parametrize(
    "wall", [WALL, toothed_wall(WALL, 0.8, 40)], ids=["plain", "teeth"]
)
def test_the_force_is_the_slope_of_the_energy(wall):
    step, pressed = 1e-3, np.array([-3.0, -0.5, 0.3, 2.0, 6.0])
    around = (pressed[:, None] + np.array([-step, step])).ravel()
    made = Ring(R, wall, LENGTH, E)
    energy = strain_energy(made, around).reshape(-1, 2)
    slope = np.diff(energy, axis=1)[:, 0] / (2.0 * step)
    force = load_curve(made, pressed)
    # Two loads work.
    assert 2.0 * force == pytest.approx(slope, rel=1e-6)


def test_the_curve_does_not_depend_on_its_path():
    up = np.linspace(0.0, 0.54, 7)
    there = load_curve(PLAIN, up)
    back = load_curve(PLAIN, [3.0, -2.0, *up[::-1]])[2:][::-1]
    assert there[0] == 0.0
    assert back == pytest.approx(there, rel=1e-8, abs=1e-8)
    tangent = stiffness(PLAIN)
    assert load_curve(PLAIN, 1e-6)[0] == pytest.approx(1e-6 * tangent)


def test_half_a_ring_is_two_quarters():
    wall = WALL * (1.0 + 0.1 * np.cos(2.0 * np.linspace(0.0, np.pi / 2, 30)))
    quarter = Ring(R, wall, LENGTH, E)
    half = quarter._replace(thickness=np.concatenate([wall, wall[::-1]]), part="half")
    pressed = [0.5, 4.0]
    assert load_curve(half, pressed) == pytest.approx(
        load_curve(quarter, pressed), rel=1e-7
    )
    assert strain_energy(half, 4.0) == pytest.approx(
        strain_energy(quarter, 4.0), rel=1e-7
    )


@pytest.mark.parametrize("share, height", [(0.5, 0.6), (0.5, 0.8), (0.6, 0.8)])
def test_teeth_stiffen_by_what_they_take_from_the_compliance(share, height):
    """200 teeth of module 0.4 mm and 1.5 to 2 modules height, on a wall of 0.68 mm."""
    wall = toothed_wall(WALL, height, 200, share=share, per_tooth=20)
    plain = stiffness(PLAIN._replace(elements=len(wall)))
    factor = stiffness(PLAIN._replace(thickness=wall)) / plain
    thinner = (WALL / (WALL + height)) ** 3
    assert factor == pytest.approx(1.0 / (1.0 - share + share * thinner), rel=1e-3)
    assert 1.3 < factor < 2.5


@pytest.mark.parametrize("teeth, share", [(202, 0.5), (200, 0.3)])
def test_teeth_that_the_quarter_cannot_hold_are_refused(teeth, share):
    with pytest.raises(ValueError, match="teeth"):
        toothed_wall(WALL, 0.8, teeth, share=share)


def test_a_ring_pressed_beyond_its_other_side_is_refused():
    with pytest.raises(NotUsable, match="ring"):
        load_curve(PLAIN, 3.0 * R)


def test_an_iteration_without_end_says_so(monkeypatch):
    monkeypatch.setattr(ring, "MOST_ITERATIONS", 1)
    with pytest.raises(NotUsable, match="no equilibrium"):
        load_curve(PLAIN, 0.5)
