"""The cup of shell elements is the ring, Rayleigh's cup and the disc in the limits."""

import numpy as np
import pytest
from benchmarks.virtual_rig_elements import cup
from benchmarks.virtual_rig_elements.banded import multiply
from benchmarks.virtual_rig_elements.cup import Cup, cup_stiffness, harmonic_stiffness
from benchmarks.virtual_rig_elements.end import End, end_stiffness

from hdcal.data.records import Geometry
from hdcal.physics import theory

R, WALL, LENGTH, E, NU = 40.0, 0.68, 70.0, 210e3, 0.3
HEIGHT = 62.0
# Not known of the example gear: the wall's thickness, a hub of half the radius.
END = End(thickness=0.68, hub=20.0)


def thin_ring(length: float) -> float:
    """π E L δ³/(24 R³ S), S = (π² − 8)/16."""
    return np.pi * E * length * WALL**3 / (24 * R**3 * (np.pi**2 - 8) / 16)


def of_the_wall(base, thickness=WALL, height=HEIGHT, **options) -> float:
    made = Cup(R, LENGTH, thickness, E, NU, base)
    return cup_stiffness(made, height, **options)


def tube_over_ring(length: float) -> float:
    """A free tube loaded all along, over the ring of modulus E/(1 − ν²)."""
    loaded = {"load_length": length, "elements": int(length / 2)}
    tube = cup_stiffness(Cup(R, length, WALL, E, NU, "free"), length / 2, **loaded)
    return tube * (1.0 - NU**2) / thin_ring(length)


def assert_a_long_tube_is_a_ring() -> None:
    """What is missing is two edges, whatever the length."""
    missing = np.array(
        [length * (1.0 - tube_over_ring(length)) for length in (100, 400)]
    )
    # The stretch of the ring, 1e-4 of the whole, is there at any length.
    assert missing[0] == pytest.approx(missing[1], rel=0.1)
    # The Poisson moment vanishes over about √(R δ) at either edge.
    assert 0.0 < missing[1] < np.sqrt(R * WALL)


def test_a_long_free_tube_is_the_ring_in_plane_strain():
    assert tube_over_ring(400.0) == pytest.approx(1.0, abs=3e-3)
    assert_a_long_tube_is_a_ring()


def test_a_strain_without_its_tangential_part_is_noticed(monkeypatch):
    right = cup._strains

    def wrong(*arguments):
        strains = right(*arguments)
        strains[..., 4, cup.V] = 0.0
        return strains

    monkeypatch.setattr(cup, "_strains", wrong)
    with pytest.raises(AssertionError):
        assert_a_long_tube_is_a_ring()
    with pytest.raises(AssertionError):
        test_rigid_motion_costs_nothing()


def test_rigid_motion_costs_nothing():
    node = np.array([0.0, 7.0, 20.0, 30.0])
    matrix = harmonic_stiffness(1, R, node, np.array([0.68, 0.9, 0.5]), E, NU)
    one, none = np.ones_like(node), np.zeros_like(node)
    shift = np.column_stack([none, none, -one, none, one, none]).ravel()
    tilt = np.column_stack([-R * one, none, -node, -one, node, one]).ravel()
    for motion in (shift, tilt):
        scale = np.max(np.abs(matrix)) * np.max(np.abs(motion))
        assert multiply(matrix, motion) == pytest.approx(0.0, abs=1e-12 * scale)


def test_the_mean_of_the_load_presses_a_tube_on_an_elastic_bed():
    """A ring load q = F/πR on a long tube: w = q β R²/(2 E δ), β⁴ = 3(1 − ν²)/(Rδ)²."""
    fine = {"load_length": 0.1, "elements": 200, "harmonics": 0}
    found = cup_stiffness(Cup(R, 100.0, WALL, E, NU), 50.0, **fine)
    beta = (3.0 * (1.0 - NU**2)) ** 0.25 / np.sqrt(R * WALL)
    exact = 2.0 * np.pi * E * WALL / (R * beta)
    assert found == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize("base", ["clamped", "held", "free", END])
def test_one_harmonic_converges_with_fourth_order(base):
    found = [
        of_the_wall(base, height=35.0, load_length=35.0, elements=m, harmonics=1)
        for m in (32, 64, 128)
    ]
    order = np.log2((found[0] - found[1]) / (found[1] - found[2]))
    assert order == pytest.approx(4.0, abs=0.1)
    assert found[1] == pytest.approx(found[2], rel=1e-4)


def test_the_sum_over_harmonics_and_the_load_have_converged():
    best = of_the_wall(END, elements=160, harmonics=80)
    assert of_the_wall(END) == pytest.approx(best, rel=2e-3)
    assert of_the_wall(END, load_length=0.5) == pytest.approx(best, rel=2e-3)


def test_held_round_a_thin_wall_bends_as_rayleigh_says():
    away = []
    for wall in (0.68, 0.2, 0.05):
        size = Geometry(wall, R, LENGTH, HEIGHT, NU)
        found = of_the_wall("held", thickness=wall, elements=80)
        away.append(abs(found / float(theory.cup(size, E)) - 1.0))
    assert away == sorted(away, reverse=True)
    assert away[0] < 0.03
    assert away[-1] < 0.006


def test_a_full_disc_bends_into_a_saddle():
    stiff = end_stiffness(2, R, End(1.0, 1e-3), E, NU)
    # f = (r/R)² cos 2φ has twists of 2/R² all over.
    saddle = np.array([1.0, 2.0 / R])
    rigidity = E / (12.0 * (1.0 - NU**2))
    energy = 8.0 * np.pi * (1.0 - NU) * rigidity / R**2
    assert saddle @ stiff @ saddle == pytest.approx(energy, rel=1e-6)


@pytest.mark.parametrize("n", [2, 8, 60])
def test_a_disc_is_symmetric_and_positive(n):
    stiff = end_stiffness(n, R, END, E, NU)
    assert stiff[0, 1] == pytest.approx(stiff[1, 0], rel=1e-9)
    assert np.all(np.linalg.eigvalsh(stiff) > 0.0)


def test_a_disc_lies_between_a_membrane_and_a_rigid_end():
    held, clamped = of_the_wall("held"), of_the_wall("clamped")
    assert of_the_wall(End(1e-3, 20.0)) == pytest.approx(held, rel=1e-6)
    assert of_the_wall(End(1e3, 20.0)) == pytest.approx(clamped, rel=1e-3)
    assert held < of_the_wall(END) < clamped


def test_zones_of_one_thickness_are_no_zones():
    zones = ((20.0, WALL), (55.0, WALL), (LENGTH, WALL))
    assert of_the_wall(END, zones) == pytest.approx(of_the_wall(END), rel=1e-4)


@pytest.mark.parametrize("zones", [((80.0, 1.0),), ((60.0, 1.0), (20.0, 1.0))])
def test_zones_that_do_not_fill_the_wall_are_refused(zones):
    with pytest.raises(ValueError, match="zones rise to the rim"):
        of_the_wall(END, zones)


def test_the_measured_factor_lies_between_the_ends_that_an_end_can_be():
    """Teeth over 20 mm at the rim, 1.82 times as stiff as their root."""
    toothed = ((50.0, WALL), (LENGTH, WALL * 1.82 ** (1 / 3)))
    plain = of_the_wall(END) / thin_ring(LENGTH)
    low, middle, high = (
        of_the_wall(base, toothed) / thin_ring(LENGTH)
        for base in ("held", END, "clamped")
    )
    assert plain < middle
    assert low < middle < 2.6 < high
