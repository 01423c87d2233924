"""The deformed ring has the shape, moment and stress of the textbook."""

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


def profile(angle):
    return ring_profile(GEAR, E, OMEGA, np.atleast_1d(angle))


def test_shape_and_moment_are_castiglianos():
    np.testing.assert_allclose(profile([0.0, np.pi]).radial, OMEGA, rtol=1e-14)
    # The width shrinks by 0.1366 where the height grows by 0.1488.
    side = profile(0.5 * np.pi).radial[0]
    assert side / OMEGA == pytest.approx((0.5 - 2 / np.pi) / (np.pi / 4 - 2 / np.pi))
    force_radius = float(ring(GEAR, E)) * OMEGA * GEAR.radius
    expected = 1.0 / np.pi - 0.5 * np.abs(np.sin(AROUND))
    found = profile(AROUND)
    np.testing.assert_allclose(found.moment / force_radius, expected, atol=1e-13)
    section = GEAR.length * GEAR.wall_thickness**2 / 6.0
    np.testing.assert_allclose(found.stress, found.moment / section, rtol=1e-12)
    assert float(found.stress[0]) > 0.0 > float(found.stress[180])


def test_the_closed_form_is_the_series():
    n, angle = 2.0 * np.arange(1, 3000), AROUND[::90, None]
    weight, found = n**2 - 1.0, profile(AROUND[::90])
    scale = OMEGA / RING_SERIES
    series = scale * np.sum(np.cos(angle * n) / weight**2, axis=1)
    np.testing.assert_allclose(found.radial, series, atol=1e-9)
    series = -scale * np.sum(np.sin(angle * n) / (n * weight**2), axis=1)
    np.testing.assert_allclose(found.tangential, series, atol=1e-9)


def test_it_does_not_stretch_and_bends_by_its_shape():
    angle = np.array([0.3, 0.9, 1.6, 2.9, 4.0])

    def along(field):
        return lambda x: getattr(ring_profile(GEAR, E, OMEGA, x[None]), field)[0]

    slide = jax.vmap(jax.grad(along("tangential")))(jnp.asarray(angle))
    bend = jax.vmap(jax.grad(jax.grad(along("radial"))))(jnp.asarray(angle))
    here = profile(angle)
    np.testing.assert_allclose(slide, -here.radial, atol=1e-13)
    curvature = -(bend + here.radial) / GEAR.radius**2
    np.testing.assert_allclose(here.curvature, curvature, atol=1e-13)


def test_the_peak_stress_is_the_largest_of_the_profile():
    peak = float(peak_stress(GEAR, E, OMEGA))
    assert float(jnp.max(profile(AROUND).stress)) == pytest.approx(peak, rel=1e-14)
    by_hand = E * GEAR.wall_thickness * OMEGA / (4.0 * RING_SERIES * GEAR.radius**2)
    assert peak == pytest.approx(float(by_hand), rel=1e-14)
