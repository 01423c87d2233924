"""The deformed ring is the textbook's: shape, moment and stress, series and closed."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from hdcal.data.records import Geometry
from hdcal.physics.profile import peak_stress, ring_profile
from hdcal.physics.theory import RING_SERIES, ring

GEAR = Geometry(0.68, 40.0, 70.0, 62.0, 0.29)
E, OMEGA = 207e3, 0.4
AROUND = np.linspace(0.0, 2.0 * np.pi, 721)


def profile(angle, **options):
    return ring_profile(GEAR, E, OMEGA, np.atleast_1d(angle), **options)


def test_it_is_deformed_as_much_as_was_asked():
    top = profile([0.0, np.pi])
    np.testing.assert_allclose(top.radial, OMEGA, rtol=1e-14)
    # Castigliano: the width shrinks by 0.1366 where the height grows by 0.1488.
    side = profile(0.5 * np.pi).radial[0]
    assert side / OMEGA == pytest.approx((0.5 - 2 / np.pi) / (np.pi / 4 - 2 / np.pi))


def test_moments_are_castiglianos():
    force_radius = float(ring(GEAR, E)) * OMEGA * GEAR.radius
    top, side = profile([0.0, 0.5 * np.pi]).moment / force_radius
    assert round(float(top), 3) == 0.318
    assert round(float(side), 3) == -0.182
    expected = 1.0 / np.pi - 0.5 * np.abs(np.sin(AROUND))
    np.testing.assert_allclose(
        profile(AROUND).moment / force_radius, expected, atol=1e-13
    )


def test_the_work_of_both_loads_is_the_bending_energy():
    angle = np.linspace(0.0, 2.0 * np.pi, 7201)
    moment = np.asarray(profile(angle).moment)
    inertia = GEAR.length * GEAR.wall_thickness**3 / 12.0
    energy = np.trapezoid(moment**2, angle) * GEAR.radius / (2.0 * E * inertia)
    work = 2.0 * 0.5 * float(ring(GEAR, E)) * OMEGA * OMEGA
    assert energy == pytest.approx(work, rel=1e-6)


@pytest.mark.parametrize("terms", [None, 7])
def test_it_does_not_stretch_and_bends_by_its_own_shape(terms):
    angle = np.array([0.3, 0.9, 1.6, 2.9, 4.0])

    def along(field):
        def at(x):
            return getattr(ring_profile(GEAR, E, OMEGA, x[None], terms=terms), field)[0]

        return at

    slide = jax.vmap(jax.grad(along("tangential")))(jnp.asarray(angle))
    bend = jax.vmap(jax.grad(jax.grad(along("radial"))))(jnp.asarray(angle))
    here = ring_profile(GEAR, E, OMEGA, angle, terms=terms)
    np.testing.assert_allclose(slide, -here.radial, atol=1e-13)
    np.testing.assert_allclose(
        here.curvature, -(bend + here.radial) / GEAR.radius**2, atol=1e-13
    )


@pytest.mark.parametrize(
    ("field", "order"), [("radial", 3), ("tangential", 4), ("moment", 1)]
)
def test_the_series_goes_to_the_closed_form(field, order):
    """Terms fall as n⁻⁴, n⁻⁵ and n⁻²: sums miss one power of n less."""
    full = np.asarray(getattr(profile(AROUND), field))
    worst = [
        np.max(np.abs(np.asarray(getattr(profile(AROUND, terms=n), field)) - full))
        for n in (100, 200)
    ]
    assert worst[1] < 5e-3 * np.max(np.abs(full))
    assert np.log2(worst[0] / worst[1]) >= order - 0.1


def test_stress_follows_the_shape_and_not_the_force():
    stress = profile(AROUND).stress
    peak = peak_stress(GEAR, E, OMEGA)
    assert float(jnp.max(stress)) == pytest.approx(float(peak), rel=1e-14)
    by_hand = E * GEAR.wall_thickness * OMEGA / (4.0 * RING_SERIES * GEAR.radius**2)
    assert float(peak) == pytest.approx(float(by_hand), rel=1e-14)
    # M over the section modulus, with the ring's own force.
    section = GEAR.length * GEAR.wall_thickness**2 / 6.0
    np.testing.assert_allclose(stress, profile(AROUND).moment / section, rtol=1e-12)
    # Pulled at the load, pressed at the side.
    assert float(stress[0]) > 0.0 > float(stress[180])


def test_it_can_be_differentiated():
    def stress(gear):
        return ring_profile(gear, E, OMEGA, jnp.zeros(1)).stress[0]

    slope = jax.grad(stress)(GEAR)
    assert slope.wall_thickness == pytest.approx(stress(GEAR) / GEAR.wall_thickness)
    assert slope.radius == pytest.approx(-2.0 * stress(GEAR) / GEAR.radius)
