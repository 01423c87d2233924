"""The force on gears without the rig, their scatter and mirror images."""

from dataclasses import replace

import numpy as np
import pytest
from designs import calibrated, known
from mirrored import mirrored
from posteriors import batch, single, spring, with_discrepancy

from hdcal.design.gears import calibrated_gears
from hdcal.errors import InputError, NotUsable
from hdcal.inference.checks import Check
from hdcal.prediction.simulate import gear_discrepancy
from hdcal.prediction.sizes import stiffness_ratio

AT, WARM = np.array([0.1, 0.4]), np.full(2, 20.0)


def test_the_rig_is_no_part_of_it():
    zeros = {"force_offset": 9.0, "deformation_offset": 0.1}
    loose = calibrated(100, "rig_compliance", rig_compliance__compliance=1e-3, **zeros)
    gears = calibrated_gears(loose)
    bend = gear_discrepancy(gears.model, AT, seed=0).T
    forces = np.outer(AT, loose.draws["stiffness"]) + bend
    np.testing.assert_allclose(gears.forces(AT, WARM), forces, 1e-9)


@pytest.mark.parametrize("theory", ["ring", "cup"])
def test_sizes_and_temperature_change_the_stiffness_by_the_formula(theory):
    gears = calibrated_gears(known(50, theory))
    sizes = {"wall_thickness_mm": 0.6, "radius_mm": 41.0}
    made = replace(gears.gear.geometry, wall_thickness=0.6, radius=41.0)
    ratio = float(stiffness_ratio(made, gears.gear.geometry, theory))
    assert gears.factor(sizes) == pytest.approx(ratio)
    force = gears.forces([0.4], [20.0], gears.factor(sizes))
    np.testing.assert_allclose(force, ratio * gears.forces([0.4], [20.0]), 1e-12)
    loss = gears.forces([0.4], [20.0]) - gears.forces([0.4], [80.0])
    draws = gears.model.draws
    expected = 60.0 * draws["alpha"] * 0.4 * draws["stiffness"]
    np.testing.assert_allclose(loss[0], expected, rtol=1e-9)


def test_tolerances_and_tested_gears_scatter_the_next_one():
    made = calibrated_gears(known(20_000)).next_ones({"wall_thickness_mm": 0.02}, 0, 1)
    factor = made.factor({})
    # Uniform within ± 0.02 mm, to the third power.
    assert np.std(factor) == pytest.approx(3 * 0.02 / 0.68 / np.sqrt(3.0), rel=0.02)
    assert factor.max() < (1.0 + 0.02 / 0.68) ** 3
    # Bending stress grows with the wall.
    stress = made.stresses({}, 0.4, [20.0])
    assert stress.max() / stress.min() == pytest.approx(0.70 / 0.66, rel=1e-2)
    assert made.strengths().mean() == pytest.approx(1125.0, rel=0.01)
    tested = calibrated_gears(batch(6, 20_000)).next_ones({}, 0, 1)
    spread = tested.model.draws["specimen_sd"]
    expected = np.sqrt(np.mean(spread**2) * (1.0 + 1.0 / 6.0))
    assert np.std(tested.deviation) == pytest.approx(expected, rel=0.05)
    assert not np.any(calibrated_gears(single()).next_ones({}, 0, 1).deviation)


@pytest.mark.parametrize("make", [with_discrepancy, lambda: batch(6, 2000)])
def test_gears_that_are_pulled_are_the_mirror_of_those_that_are_pressed(make):
    gear, at = make(), np.array([0.1, 0.4, 0.7])
    pressed = calibrated_gears(gear).next_ones({}, 0, 1)
    pulled = calibrated_gears(mirrored(gear)).next_ones({}, 0, -1)
    asked = at, np.array([20.0, 20.0, 60.0]), pressed.factor({}).reshape(-1, 1)
    np.testing.assert_allclose(pulled.forces(*asked), pressed.forces(*asked), 1e-9)


def test_unsuitable_sources_are_refused():
    failed = replace(single(size=100), checks=(Check("R-hat", "failed", "it is 1.2"),))
    with pytest.raises(NotUsable):
        calibrated_gears(failed)
    with pytest.raises(InputError, match="has no sizes"):
        calibrated_gears(spring())
