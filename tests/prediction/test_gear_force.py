"""The force on a gear alone, what it leaves out, and its exact derivatives."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from designs import bent, known
from posteriors import single

from hdcal.design.design_draws import design_draws
from hdcal.design.inverse_design.force_limit import LimitedGear
from hdcal.design.inverse_design.limit import LimitAsked
from hdcal.design.next_gear import next_gear
from hdcal.design.study import force_quantiles as quantiles_module
from hdcal.design.study.force_quantiles import (
    force_quantiles,
    general_quantiles,
    is_linear,
)
from hdcal.errors import InputError
from hdcal.inference.model_average import LeftOut, ModelAverage
from hdcal.physics.effects.loops import Hysteresis
from hdcal.physics.effects.sensor import RigCompliance
from hdcal.prediction.engine.gear_forces import gear_forces
from hdcal.prediction.engine.sizes import stiffness_ratio

SHARES = np.array([0.5, 0.025, 0.975])


def one(draws):
    return {name: values[:1] for name, values in draws.values.items()}


def test_the_rig_is_no_part_of_it():
    draws = known()
    value = {**one(draws), "rig_compliance.compliance": np.full(1, 1e-3)}
    loose = replace(draws.problem, effects=(RigCompliance,))
    at, warm = np.array([0.1, 0.4]), np.full(2, 20.0)
    force = gear_forces(loose, value, at, warm)[:, 0]
    stiffness = value["K"] * value["E0"] * draws.problem.unit_stiffness
    np.testing.assert_allclose(force, stiffness * at, rtol=1e-13)
    zeros = {"force_offset": np.full(1, 9.0), "deformation_offset": np.full(1, 0.1)}
    other = gear_forces(loose, value | zeros, at, warm)[:, 0]
    np.testing.assert_array_equal(force, other)


def test_a_diametral_rig_changes_nothing():
    draws = known()
    half = replace(draws.problem, reading=replace(draws.problem.reading))
    half = replace(half, reading=replace(half.reading, radial_per_read=0.5))
    at, warm = np.array([0.1, 0.4]), np.full(2, 20.0)
    np.testing.assert_allclose(
        gear_forces(half, one(draws), at, warm),
        gear_forces(draws.problem, one(draws), at, warm),
        rtol=1e-13,
    )


def test_each_row_is_a_gear_at_rest():
    draws = known()
    sticking = replace(draws.problem, effects=(Hysteresis,))
    loop = {"hysteresis.force": np.full(1, 5.0), "hysteresis.reach": np.full(1, 0.1)}
    value = one(draws) | loop
    at, warm = np.array([0.5, 0.05, 0.3]), np.full(3, 20.0)
    together = gear_forces(sticking, value, at, warm)
    alone = gear_forces(sticking, value, at[1:2], warm[:1])
    assert float(together[1, 0]) == pytest.approx(float(alone[0, 0]), rel=1e-13)


@pytest.mark.parametrize("make", [known, bent])
def test_blocks_of_designs_are_the_obvious_loop(make, monkeypatch):
    draws = make(200)
    random = np.random.default_rng(0)
    factor, at = random.uniform(0.5, 2.0, 7), random.uniform(0.1, 0.5, 7)
    warm = random.choice([20.0, 80.0], 7)
    monkeypatch.setattr(quantiles_module, "_BLOCK", 3 * 200)
    slow = []
    for f, x, t in zip(factor, at, warm, strict=True):
        rise = t - 20.0
        force = draws.values["K"] * 207e3 * draws.problem.unit_stiffness * f * x
        force = force * (1.0 - draws.values["alpha"] * rise)
        slope = draws.values.get("progressive_stiffening.slope", 0.0)
        depth = np.hypot(x, 1e-4) - 1e-4
        slow.append(np.quantile(force * (1.0 + slope * depth), SHARES))
    for fast in (force_quantiles, general_quantiles):
        found = fast(draws, factor, at, warm, SHARES)
        np.testing.assert_allclose(found.T, slow, rtol=1e-12)
    assert is_linear(draws) == (make is known)


def limit(deformation, temperatures, probability) -> LimitAsked:
    """Return a limit of 60 N."""
    return LimitAsked(
        deformation_mm=deformation,
        temperature_C=temperatures,
        limit_force_N=60.0,
        limit_stress_MPa=None,
        probability=probability,
        bounds={},
        tolerances_mm={},
    )


@pytest.mark.parametrize("theory", ["ring", "cup"])
@pytest.mark.parametrize("make", [known, bent])
def test_derivatives_are_those_of_finite_differences(make, theory):
    draws = make(500, theory)
    gear = next_gear(draws, {"wall_thickness_mm": 0.02, "radius_mm": 0.05})
    target = LimitedGear.of(draws, gear, limit(0.3, (-20.0, 80.0), 0.95))
    place = {
        "wall_thickness_mm": 0.66,
        "radius_mm": 41.0,
        "length_mm": 68.0,
        "deformation_mm": 0.4,
        "modulus": 1.0,
        "K": 1.0,
    }
    place = {name: jnp.asarray(value) for name, value in place.items()}
    force = jax.jit(lambda x: target.force(x))
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
    draws = bent(500)
    target = LimitedGear.of(draws, next_gear(draws), limit(0.4, (20.0,), 0.95))
    slope = jax.grad(lambda x: target.force({"deformation_mm": x}))
    # That of the straight line alone.
    straight = target.force({}) / 0.4
    assert float(slope(0.4)) != pytest.approx(float(straight), rel=1e-2)


def test_no_fewer_draws_keep_the_limit_than_were_asked_for():
    draws = known(2000)
    for probability in (0.5, 0.9, 0.99, 0.995):
        target = LimitedGear.of(
            draws, next_gear(draws), limit(0.4, (20.0,), probability)
        )
        share = np.mean(np.asarray(target.forces({})) <= float(target.force({})))
        assert probability <= share < probability + 2.0 / draws.size


def test_tolerances_and_tested_gears_scatter_the_next_one():
    draws = replace(known(20_000), kind="posterior")
    assert not np.any(next_gear(draws).gears.deviation)
    made = next_gear(draws, {"wall_thickness_mm": 0.02})
    sizes = made.gears.made(draws.drawing)
    factor = np.asarray(stiffness_ratio(sizes, draws.gear.geometry, draws.theory))
    # Uniform within ± 0.02 mm, to the third power.
    assert np.std(factor) == pytest.approx(3 * 0.02 / 0.68 / np.sqrt(3.0), rel=0.02)
    assert factor.max() < (1.0 + 0.02 / 0.68) ** 3
    tested = replace(
        draws,
        problem=replace(draws.problem, specimens=5),
        values={**draws.values, "specimen_sd": np.full(20_000, 0.05)},
    )
    spread = np.std(next_gear(tested).gears.deviation)
    assert spread == pytest.approx(0.05 * np.sqrt(1.2), rel=0.02)
    with pytest.raises(InputError, match="Did you mean 'radius_mm'"):
        next_gear(draws, {"radius": 0.02})
    with pytest.raises(InputError, match="± part in mm"):
        next_gear(draws, {"wall_thickness_mm": 0.5})


def test_the_nominal_deformation_is_the_gears_own():
    """The gear file says it as read: of a diametral reading half is the gear's."""
    draws = known()
    gear = replace(draws.gear, nominal_deformation=0.8)
    half = replace(draws.problem.reading, radial_per_read=0.5)
    read = replace(draws, gear=gear, problem=replace(draws.problem, reading=half))
    assert read.nominal_deformation == pytest.approx(0.4)
    assert replace(draws, gear=gear).nominal_deformation == pytest.approx(0.8)


def test_what_a_diagnosis_left_out_is_told():
    weighed = {"contact_onset": (1.0, single(size=100))}
    for share, told in ((0.0, False), (0.08, True)):
        left_out = LeftOut(share, "contact_onset")
        words = design_draws(ModelAverage(weighed, left_out)).misfits
        assert any("8 % of the probability" in one for one in words) == told
