"""Shipped priors are shares of the largest readings of a rig."""

import numpy as np
import pytest
from rigs import make_gear

from hdcal.data.full_scale import REFERENCE, FullScale
from hdcal.data.prior import Prior
from hdcal.data.priors import effect_priors
from hdcal.data.reading import read_case

GEAR = """\
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
[measurement]
deformation = "diametral"
[priors]
coulomb_friction.force = { family = "half_normal", sd = 7.0, unit = "N" }
"""
SPRING = {
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}
RIG = FullScale(force=3700.0, deformation=0.1)


@pytest.mark.parametrize(
    ("unit", "ratio"),
    [
        ("N", 37.0),
        ("mm", 0.2),
        ("1/mm", 5.0),
        ("mm/N", 0.2 / 37.0),
        ("N*s/mm", 37.0 * 5.0),
        ("1/N^2", 37.0**-2),
        ("N/K", 37.0),
        ("mm/K", 0.2),
        ("1/K", 1.0),
        ("s", 1.0),
        ("1", 1.0),
    ],
)
def test_newtons_and_millimetres_go_with_the_readings(unit, ratio):
    prior = Prior("normal", (2.0, 3.0), unit)
    np.testing.assert_allclose(RIG.own(prior).numbers, (2.0 * ratio, 3.0 * ratio))
    assert REFERENCE.own(prior) is prior


def test_a_spread_of_logarithms_and_a_share_have_no_scale():
    own = effect_priors(RIG)
    shipped = effect_priors()
    assert own["outliers.fraction"] == shipped["outliers.fraction"]
    reach, was = own["hysteresis.reach"], shipped["hysteresis.reach"]
    assert reach.numbers[1] == was.numbers[1]
    assert reach.numbers[0] == pytest.approx(0.2 * was.numbers[0])


def test_a_case_takes_them_from_its_largest_readings(tmp_path):
    w = np.linspace(0.01, 0.8, 200)
    w[17] = 40.0  # one wild reading in two hundred
    rows = "\n".join(f"{x!r},{50.0 * min(x, 1.0)!r}" for x in w.tolist())
    (tmp_path / "data.csv").write_text(f"deformation_mm,force_N\n{rows}\n")
    (tmp_path / "gear.toml").write_text(GEAR)
    gear = read_case(tmp_path).gear
    # Radial: half of what is read.
    # The wild reading is left out, and of the others one in a hundred may be wild.
    assert gear.full_scale.deformation == pytest.approx(0.4 * 0.98, rel=0.02)
    assert gear.full_scale.force == pytest.approx(40.0 * 0.98, rel=0.02)
    # What the gear file states stays as it is.
    assert gear.effect_priors["coulomb_friction.force"].numbers == (7.0,)


def test_a_zero_that_nobody_states_may_be_anywhere():
    x = np.linspace(100.0, 101.0, 20)
    gear = read_case({"deformation_mm": x, "force_N": 5.0 * x}, gear=SPRING).gear
    before = make_gear().priors
    assert gear.priors["deformation_offset"] == before["deformation_offset"]
    # Ten times the range, the level and the way to the origin, 5 N/mm · 100.5 mm.
    zero = gear.priors["force_offset"].numbers
    assert zero == pytest.approx((0.0, 10.0 * (5.0 + 502.5 + 502.5)), rel=0.02)
    assert gear.full_scale.force == pytest.approx(5.0, rel=0.02)
    assert gear.full_scale.deformation == pytest.approx(1.0, rel=0.02)
