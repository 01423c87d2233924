"""The force on a gear alone, what it leaves out, and its exact derivatives."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from designs import bent, known
from posteriors import single

from hdcal.design.design_draws import basis_of
from hdcal.design.force_limit import Target
from hdcal.design.next_gear import next_gear
from hdcal.design.study.study import force_quantiles, general_quantiles, is_linear
from hdcal.errors import InputError
from hdcal.physics.effects.hysteresis import Hysteresis
from hdcal.physics.effects.rig_compliance import RigCompliance
from hdcal.prediction.forces import gear_force

SHARES = np.array([0.5, 0.025, 0.975])


def one(basis, index=0):
    return {name: values[index] for name, values in basis.values.items()}


def test_the_rig_is_no_part_of_it():
    basis = known()
    value = {**one(basis), "rig_compliance.compliance": 1e-3}
    loose = replace(basis.problem, effects=(RigCompliance,))
    at, warm = np.array([0.1, 0.4]), np.full(2, 20.0)
    force = gear_force(loose, value, at, warm)
    stiffness = value["K"] * value["E0"] * basis.problem.unit_stiffness
    np.testing.assert_allclose(force, stiffness * at, rtol=1e-13)
    other = {**value, "force_offset": 9.0, "deformation_offset": 0.1}
    np.testing.assert_array_equal(force, gear_force(loose, other, at, warm))


def test_a_diametral_rig_changes_nothing():
    basis = known()
    half = replace(basis.problem, reading=replace(basis.problem.reading))
    half = replace(half, reading=replace(half.reading, radial_per_read=0.5))
    at, warm = np.array([0.1, 0.4]), np.full(2, 20.0)
    np.testing.assert_allclose(
        gear_force(half, one(basis), at, warm),
        gear_force(basis.problem, one(basis), at, warm),
        rtol=1e-13,
    )


def test_each_row_is_a_gear_at_rest():
    basis = known()
    sticking = replace(basis.problem, effects=(Hysteresis,))
    value = {**one(basis), "hysteresis.force": 5.0, "hysteresis.reach": 0.1}
    at, warm = np.array([0.5, 0.05, 0.3]), np.full(3, 20.0)
    together = gear_force(sticking, value, at, warm)
    alone = gear_force(sticking, value, at[1:2], warm[:1])
    assert float(together[1]) == pytest.approx(float(alone[0]), rel=1e-13)


@pytest.mark.parametrize("make", [known, bent])
def test_blocks_of_designs_are_the_obvious_loop(make, monkeypatch):
    basis = make(200)
    random = np.random.default_rng(0)
    factor, at = random.uniform(0.5, 2.0, 7), random.uniform(0.1, 0.5, 7)
    warm = random.choice([20.0, 80.0], 7)
    monkeypatch.setattr("hdcal.design.study.study._BLOCK", 3 * 200)
    slow = []
    for f, x, t in zip(factor, at, warm, strict=True):
        rise = t - 20.0
        force = basis.values["K"] * 207e3 * basis.problem.unit_stiffness * f * x
        force = force * (1.0 - basis.values["alpha"] * rise)
        slope = basis.values.get("progressive_stiffening.slope", 0.0)
        depth = np.hypot(x, 1e-4) - 1e-4
        slow.append(np.quantile(force * (1.0 + slope * depth), SHARES))
    for fast in (force_quantiles, general_quantiles):
        found = fast(basis, factor, at, warm, SHARES)
        np.testing.assert_allclose(found.T, slow, rtol=1e-12)
    assert is_linear(basis) == (make is known)


@pytest.mark.parametrize("theory", ["ring", "cup"])
@pytest.mark.parametrize("make", [known, bent])
def test_derivatives_are_those_of_finite_differences(make, theory):
    basis = make(500, theory)
    gear = next_gear(basis, {"wall_thickness_mm": 0.02, "radius_mm": 0.05})
    target = Target.of(basis, gear, np.array([-20.0, 80.0]), 0.95)
    geometry = basis.gear.geometry
    place = {
        "wall_thickness_mm": 0.66,
        "radius_mm": 41.0,
        "length_mm": 68.0,
        "deformation_mm": 0.4,
        "modulus": 1.0,
        "K": 1.0,
    }
    place = {name: jnp.asarray(value) for name, value in place.items()}
    force = jax.jit(lambda x: target.force(geometry, x))
    slopes = jax.grad(force)(place)
    for name, value in place.items():
        step = 1e-4 * value

        def moved(by, name=name, value=value):
            return force({**place, name: value + by})

        # Fourth order, so that truncation is far below what is asked.
        ahead = 8.0 * (moved(step) - moved(-step)) - moved(2 * step) + moved(-2 * step)
        difference = float(ahead / (12.0 * step))
        assert float(slopes[name]) == pytest.approx(difference, rel=1e-6), name


def test_a_wrong_derivative_would_be_seen():
    basis = bent(500)
    target = Target.of(basis, next_gear(basis), np.array([20.0]), 0.95)
    geometry = basis.gear.geometry
    place = {"deformation_mm": jnp.asarray(0.4), "modulus": 1.0, "K": 1.0}
    slope = jax.grad(lambda x: target.force(geometry, {**place, "deformation_mm": x}))
    # That of the straight line alone.
    straight = target.force(geometry, place) / 0.4
    assert float(slope(0.4)) != pytest.approx(float(straight), rel=1e-2)


def test_no_fewer_draws_keep_the_limit_than_were_asked_for():
    basis = known(2000)
    for probability in (0.5, 0.9, 0.99, 0.995):
        target = Target.of(basis, next_gear(basis), np.array([20.0]), probability)
        place = {"deformation_mm": 0.4, "modulus": 1.0, "K": 1.0}
        limit = float(target.force(basis.gear.geometry, place))
        forces = np.asarray(target.forces(basis.gear.geometry, 0.4, 1.0, 1.0))
        share = np.mean(forces <= limit)
        assert probability <= share < probability + 2.0 / basis.size


def test_tolerances_and_tested_gears_scatter_the_next_one():
    basis = replace(known(20_000), kind="posterior")
    assert not np.any(next_gear(basis).deviation)
    assert "no statement about a population" in next_gear(basis).words
    made = next_gear(basis, {"wall_thickness_mm": 0.02})
    factor = np.asarray(made.factor(basis, basis.gear.geometry))
    # Uniform within ± 0.02 mm, to the third power.
    assert np.std(factor) == pytest.approx(3 * 0.02 / 0.68 / np.sqrt(3.0), rel=0.02)
    assert factor.max() < (1.0 + 0.02 / 0.68) ** 3
    tested = replace(
        basis,
        problem=replace(basis.problem, specimens=5),
        values={**basis.values, "specimen_sd": np.full(20_000, 0.05)},
    )
    spread = np.std(next_gear(tested).deviation)
    assert spread == pytest.approx(0.05 * np.sqrt(1.2), rel=0.02)
    assert "5 tested ones" in next_gear(tested).words
    with pytest.raises(InputError, match="Did you mean 'radius_mm'"):
        next_gear(basis, {"radius": 0.02})
    with pytest.raises(InputError, match="± part in mm"):
        next_gear(basis, {"wall_thickness_mm": 0.5})


def test_the_nominal_deformation_is_the_gears_own():
    """The gear file says it as read: of a diametral reading half is the gear's."""
    basis = known()
    gear = replace(basis.gear, nominal_deformation=0.8)
    half = replace(basis.problem.reading, radial_per_read=0.5)
    read = replace(basis, gear=gear, problem=replace(basis.problem, reading=half))
    assert read.nominal_deformation == pytest.approx(0.4)
    assert replace(basis, gear=gear).nominal_deformation == pytest.approx(0.8)


def test_a_cause_that_is_not_settled_is_told():
    posterior = single(size=100)
    assert basis_of(posterior).misfits == ()
    origin = {"hypothesis": "contact_onset", "probabilities": {"contact_onset": 0.6}}
    settled = {**posterior.settings, "diagnosis": origin}
    assert basis_of(replace(posterior, settings=settled)).misfits == ()
    origin = {**origin, "probabilities": {"contact_onset": 0.6, "none": 0.4}}
    open_one = {**posterior.settings, "diagnosis": origin}
    (words,) = basis_of(replace(posterior, settings=open_one)).misfits
    assert "rests on contact onset alone" in words
