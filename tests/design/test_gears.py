"""The force on gears without the rig, their scatter, materials and mirror images."""

from dataclasses import replace

import numpy as np
import pytest
from designs import bent, calibrated, known
from mirrored import mirrored
from posteriors import batch, single, with_leftover

from hdcal.design.gears import draw_gears
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.prediction.simulate import gear_leftover
from hdcal.prediction.sizes import stiffness_ratio

AT, WARM = np.array([0.1, 0.4]), np.full(2, 20.0)


def test_the_rig_is_no_part_of_it():
    loose = calibrated(
        100,
        "rig_compliance",
        rig_compliance__compliance=1e-3,
        force_offset=9.0,
        deformation_offset=0.1,
    )
    stiffness = loose.values["stiffness"]
    bend = gear_leftover(loose.model, AT, seed=0).T
    forces = np.outer(AT, stiffness) + bend
    np.testing.assert_allclose(loose.forces(AT, WARM), forces, 1e-9)
    diametral = replace(loose.gear, reading="diametral", nominal_deformation=0.8)
    assert replace(loose, gear=diametral).radial_per_read == 0.5


@pytest.mark.parametrize("theory", ["ring", "cup"])
def test_sizes_and_temperature_change_the_stiffness_by_the_formula(theory):
    gears = known(50, theory)
    sizes = {"wall_thickness_mm": 0.6, "radius_mm": 41.0}
    made = replace(gears.gear.geometry, wall_thickness=0.6, radius=41.0)
    ratio = float(stiffness_ratio(made, gears.gear.geometry, theory))
    assert gears.factor(sizes) == pytest.approx(ratio)
    force = gears.forces([0.4], [80.0], gears.factor(sizes))
    warm = 1.0 - 60.0 * gears.values["alpha"]
    np.testing.assert_allclose(force, ratio * warm * gears.forces([0.4], [20.0]), 1e-12)


def test_tolerances_and_tested_gears_scatter_the_next_one():
    made = known(20_000).next_ones({"wall_thickness_mm": 0.02}, 0, 1)
    factor = made.factor({})
    # Uniform within ± 0.02 mm, to the third power.
    assert np.std(factor) == pytest.approx(3 * 0.02 / 0.68 / np.sqrt(3.0), rel=0.02)
    assert factor.max() < (1.0 + 0.02 / 0.68) ** 3
    tested = draw_gears(batch(6, 20_000)).next_ones({}, 0, 1)
    spread = tested.values["specimen_sd"]
    expected = np.sqrt(np.mean(spread**2) * (1.0 + 1.0 / 6.0))
    assert np.std(tested.deviation) == pytest.approx(expected, rel=0.05)
    assert not np.any(draw_gears(single()).next_ones({}, 0, 1).deviation)


@pytest.mark.parametrize("make", [single, with_leftover, lambda: batch(6, 2000)])
def test_gears_that_are_pulled_are_the_mirror_of_those_that_are_pressed(make):
    gear, at = make(), np.array([0.1, 0.4, 0.7])
    pressed = draw_gears(gear).next_ones({}, 0, 1)
    pulled = draw_gears(mirrored(gear)).next_ones({}, 0, -1)
    asked = at, np.array([20.0, 20.0, 60.0]), pressed.factor({}).reshape(-1, 1)
    np.testing.assert_allclose(pulled.forces(*asked), pressed.forces(*asked), 1e-9)


def test_another_material_changes_modulus_and_the_fitted_rest():
    steel = draw_gears(with_leftover(2000))
    soft = steel.of_material("PEEK", 0)
    share = soft.values["E0"] / steel.values["E0"]
    force, other = (gears.forces([0.4], [20.0]) for gears in (steel, soft))
    np.testing.assert_allclose(other, share * force, rtol=1e-9)
    assert soft.drawing({}).poisson == 0.39 != steel.drawing({}).poisson
    assert known(20_000).strengths().mean() == pytest.approx(1125.0, rel=0.01)
    wide = known(2000).next_ones({"wall_thickness_mm": 0.1}, 0, 1)
    # Bending stress grows with the wall.
    stress = wide.stresses({}, 0.4, [20.0])
    assert stress.max() / stress.min() == pytest.approx(0.78 / 0.58, rel=1e-2)


def test_unsuitable_sources_are_refused():
    failed = replace(single(size=100), checks=(Check("R-hat", "failed", "it is 1.2"),))
    with pytest.raises(NotUsable):
        draw_gears(failed)
    spring = replace(known(100).gear, theory="spring")
    with pytest.raises(InputError, match="has no sizes"):
        draw_gears(spring)
    with pytest.raises(InputError, match="Did you mean 'steel'"):
        bent(10).of_material("stel", 0)
