"""Single effects against the mechanics that they stand for."""

import dataclasses
from functools import cache
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_bench import bare, typical
from scipy import integrate, optimize

from hdcal.physics.chain import predict_reading
from hdcal.physics.effect import Rows

STIFFNESS = 209.0


def rows_of(deformation, records=None, rise=0.0) -> Rows:
    """Return what an effect sees of a gear of constant stiffness."""
    shape = np.shape(deformation)
    rise, stiffness = np.broadcast_to(rise, shape), np.full(shape, STIFFNESS)
    return Rows(records, jnp.asarray(rise), stiffness, jnp.asarray(deformation))


def force_on(effect, deformation, records=None) -> np.ndarray:
    """Return the force of a gear of constant stiffness with one effect."""
    rows = rows_of(deformation, records)
    return np.asarray(effect.apply(STIFFNESS * rows.deformation, rows))


def reading_of(effects, base, records, reading):
    return np.asarray(predict_reading(base, effects, records, reading)[0])


def test_bedding_is_in_series_with_the_gear():
    effect = typical("contact_bedding")
    read = np.linspace(-0.6, 0.6, 200)
    seen = np.asarray(effect.apply(read, rows_of(read)))
    force = STIFFNESS * np.abs(seen)
    closure = effect.closure * force / (force + effect.load)
    np.testing.assert_allclose(np.abs(seen) + closure, np.abs(read), atol=1e-6)
    half = effect.load / STIFFNESS + 0.5 * effect.closure
    assert effect.apply(np.array([half]), rows_of([half]))[0] == pytest.approx(
        half - 0.5 * effect.closure, abs=1e-7
    )


def test_friction_under_load_draws_a_wedge_and_pinches_a_loop_of_both_signs():
    way = np.array([0.0, 0.2, 0.4, 0.2, 0.0, -0.3, -0.1, 0.1])
    slope = np.array([1.1, 1.1, 1.1, 0.9, 0.9, 1.1, 0.9, 1.1])
    sense = SimpleNamespace(sense=np.sign(np.diff(way, prepend=-1.0)))
    found = force_on(typical("load_friction", share=0.1), way, sense)
    np.testing.assert_allclose(found, STIFFNESS * slope * way, atol=1e-12)


def test_a_compliant_rig_is_a_softer_gear(scattered, base, reading):
    effect = typical("rig_compliance")
    records = dataclasses.replace(scattered(0), temperature=np.full(24, 20.0))
    both = 1.0 / (1.0 / base.stiffness + effect.compliance)
    softer = dataclasses.replace(base, stiffness=both)
    np.testing.assert_allclose(
        reading_of([effect], base, records, reading),
        reading_of([], softer, records, reading),
        rtol=1e-12,
    )


def test_thermal_stiffness_is_another_alpha(scattered, base, reading):
    effect = typical("thermal_stiffness")
    records, base = scattered(2), bare(base)
    other = dataclasses.replace(base, alpha=-effect.slope)
    np.testing.assert_allclose(
        reading_of([effect], base, records, reading),
        reading_of([], other, records, reading),
        rtol=1e-12,
    )


def test_the_screw_repeats_each_turn():
    effect = typical("screw_error")
    read = np.linspace(-0.5, 0.5, 400)
    error = np.asarray(effect.apply(read, rows_of(read))) - read
    size = np.hypot(effect.sine, effect.cosine)
    phase = np.arctan2(effect.cosine, effect.sine)
    expected = size * np.sin(2.0 * np.pi * read / effect.pitch + phase)
    np.testing.assert_allclose(error, expected, rtol=1e-9, atol=1e-15)


def test_the_second_contact_has_its_own_slope():
    effect = typical("contact_onset")
    deformation = np.linspace(-0.54, 0.54, 217)
    sharp = np.maximum(0.0, np.abs(deformation) - effect.onset) * np.sign(deformation)
    expected = STIFFNESS * (deformation + effect.ratio * sharp)
    found = force_on(effect, deformation)
    # At the corner itself half of its rounding is missing.
    width = 0.02 * effect.onset
    rounding = 0.51 * width * effect.ratio * STIFFNESS
    np.testing.assert_allclose(found, expected, atol=rounding)
    away = np.abs(np.abs(deformation) - effect.onset) > 10.0 * width
    np.testing.assert_allclose(found[away], expected[away], rtol=1e-3, atol=0.02)


@cache
def flattened_ring(load: float) -> float:
    """Return ω/R of the elastic ring of EI = R = 1 under two opposed forces 2·load.

    A quarter from the loaded point, tangent angle 0, to the side, angle 90°; half of
    the force runs down each side: κ' = load · cos θ.
    """

    def bend(_, state):
        angle, curvature, _ = state
        return [curvature, load * np.cos(angle), np.sin(angle)]

    def end(curvature):
        quarter = (0.0, 0.5 * np.pi)
        start = [0.0, curvature, 0.0]
        exact = {"rtol": 1e-11, "atol": 1e-12}
        return integrate.solve_ivp(bend, quarter, start, **exact).y[:, -1]

    found = optimize.brentq(lambda k: end(k)[0] - 0.5 * np.pi, -3.0, 5.0, xtol=1e-13)
    return 1.0 - end(found)[2]


@pytest.mark.parametrize("load", [-0.25, 0.05, 0.25])
def test_a_large_deflection_is_the_elasticas(load):
    relative = flattened_ring(load)
    effect, radius = typical("large_deflection"), 40.0
    assert effect.curvature == 1.0 / radius
    # Small deflections: F/ω of the ring of EI = R = 1, see the theory of the ring.
    small = 8.0 * np.pi / (np.pi**2 - 8.0)
    exact = 2.0 * load / (small * relative)
    found = force_on(effect, [relative * radius])[0] / (STIFFNESS * relative * radius)
    # The next term of the series.
    assert found == pytest.approx(exact, abs=8.0 * abs(relative) ** 3 + 1e-6)
    assert abs(exact - 1.0) > 1.4 * abs(relative)


def yielded(deformation, records):
    return force_on(typical("plastic_yield"), deformation, records)


def test_yield_leaves_a_set(scattered):
    effect = typical("plastic_yield")
    path = np.concatenate([np.linspace(0.0, 0.55, 12), np.linspace(0.55, 0.0, 12)])
    records = dataclasses.replace(scattered(0), specimen=np.zeros(24, int))
    force = yielded(path, records)
    # Exactly elastic before: the curve of a gear that never yields has no direction.
    inside = np.flatnonzero(path[:12] < effect.yield_deformation)
    np.testing.assert_array_equal(force[inside], STIFFNESS * path[inside])
    beyond = np.flatnonzero(path[:12] > effect.yield_deformation)
    slope = np.diff(force[beyond]) / np.diff(path[beyond])
    np.testing.assert_allclose(slope, STIFFNESS * (1.0 - effect.softening), rtol=1e-9)
    # Back along the elastic line, and no force at the set.
    np.testing.assert_allclose(np.diff(force[12:]) / np.diff(path[12:]), STIFFNESS)
    left = effect.softening * (0.55 - effect.yield_deformation)
    assert force[-1] == pytest.approx(-STIFFNESS * left)


def test_the_set_outlives_the_run_but_not_the_specimen(scattered):
    records = jax.tree.map(lambda leaf: leaf[:16], scattered(0))
    path = np.tile([0.1, 0.3, 0.5, 0.6, 0.5, 0.3, 0.2, 0.1], 2)
    same = dataclasses.replace(records, specimen=np.zeros(16, int))
    assert np.unique(same.run).size == 2
    kept, fresh = yielded(path, same), yielded(path, records)
    np.testing.assert_allclose(fresh[8:], fresh[:8], rtol=1e-12)
    np.testing.assert_allclose(kept[:8], fresh[:8], rtol=1e-12)
    # The second time it goes up where it came down.
    np.testing.assert_allclose(kept[8:11], kept[[7, 5, 4]], rtol=1e-12)
    # Rows of two specimens may take turns in a file.
    turns = np.arange(16).reshape(2, 8).T.ravel()
    mixed = jax.tree.map(lambda leaf: leaf[turns], records)
    np.testing.assert_allclose(yielded(path[turns], mixed), fresh[turns], rtol=1e-12)
