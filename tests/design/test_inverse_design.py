"""The sizes keep the limits with the least change, as algebra gives them."""

from inspect import signature

import numpy as np
import pytest
from designs import known
from mirrored import mirrored
from posteriors import single
from schema_checks import obeys

from hdcal.design.gears import calibrated_gears
from hdcal.design.inverse_design import InverseDesign, inverse_design
from hdcal.errors import InputError
from hdcal.physics.theory import peak_stress
from hdcal.report.charts.chart_spec import Rule

WALL, RADIUS = {"wall_thickness_mm": (0.4, 0.9)}, {"radius_mm": (32.0, 50.0)}


def kept_force(gear, probability=0.99):
    forces = np.sort(calibrated_gears(gear).forces([0.4], [20.0])[0])
    return float(forces[int(np.ceil(probability * len(forces))) - 1])


def test_one_size_is_the_cube_root():
    gears = known()
    found = inverse_design(gears, WALL, 60.0)
    wall = 0.68 * (60.0 / kept_force(gears)) ** (1.0 / 3.0)
    assert found.design.sizes["wall_thickness_mm"] == pytest.approx(wall, rel=1e-7)
    assert found.design.force_kept_N == pytest.approx(60.0, rel=1e-6)
    assert 0.99 <= found.design.probability < 0.99 + 2.0 / 2000
    assert found.tested.force_kept_N == pytest.approx(kept_force(gears), rel=1e-12)
    assert "wall thickness" in found.headline
    obeys(found.to_dict(), InverseDesign)


def test_several_sizes_change_along_the_gradient():
    """Least Σ (ln x/x₀)² on 3 ln δ − 3 ln R + ln L = const is along (3, −3, 1)."""
    gears = known()
    free = WALL | RADIUS | {"length_mm": (63.0, 90.0)}
    found = inverse_design(gears, free, 60.0)
    steps = np.log(np.array(list(found.design.sizes.values())) / [0.68, 40.0, 70.0])
    needed = np.log(60.0 / kept_force(gears))
    expected = needed * np.array([3.0, -3.0, 1.0]) / 19.0
    np.testing.assert_allclose(steps, expected, rtol=1e-5)
    assert found.design.change == pytest.approx(abs(needed) / np.sqrt(19.0), rel=1e-6)
    # At a bound the other size changes more.
    free = {"wall_thickness_mm": (0.66, 0.9)} | RADIUS
    sizes = inverse_design(gears, free, 60.0).design.sizes
    assert sizes["wall_thickness_mm"] == pytest.approx(0.66, rel=1e-9)
    left = needed - 3.0 * np.log(0.66 / 0.68)
    assert sizes["radius_mm"] == pytest.approx(40.0 * np.exp(-left / 3.0), rel=1e-6)


def test_the_table_of_designs_ends_before_the_sentence_on_it():
    found = inverse_design(known(200), WALL, 60.0, probability=0.9)
    page = found.page("hdcal design RUN")
    table = page[page.index("keeps the limit") : page.index("Force and stress are")]
    assert table.count("</tr>") == 3 and table.endswith("</div><p>")


def test_the_coldest_temperature_decides():
    mild, cold = (
        inverse_design(known(), WALL, 60.0, temperatures=levels).design.sizes_mm
        for levels in ([20.0], [-40.0, 80.0])
    )
    ratio = cold["wall_thickness"] / mild["wall_thickness"]
    assert ratio == pytest.approx((1.0 + 60.0 * 3e-4) ** (-1.0 / 3.0), rel=2e-3)


def test_the_stress_is_limited_too():
    """The force alone would have a thicker wall than the stress allows."""
    gears = known()
    free = inverse_design(gears, WALL | RADIUS, 60.0)
    assert free.design.utilisation_kept < 0.2
    limit = 0.9 * free.design.stress_MPa.median
    tight = inverse_design(gears, WALL | RADIUS, 60.0, limit_stress=limit)
    assert tight.design.utilisation_kept == pytest.approx(1.0, rel=1e-5)
    assert tight.design.change > free.design.change
    drawn = calibrated_gears(gears).made(tight.design.sizes)
    assert float(peak_stress(drawn, 207e3, 0.4)) == pytest.approx(limit, rel=1e-6)


def test_a_gear_that_is_pulled_has_the_mirrored_design():
    gear, asked = single(size=400), {"probability": 0.9, "limit_stress": 60.0}
    pressed, pulled = (
        inverse_design(one, WALL, 70.0, deformation=at, **asked)
        for one, at in ((gear, 0.4), (mirrored(gear), -0.4))
    )
    assert pulled.design.sizes_mm == pytest.approx(pressed.design.sizes_mm)
    assert pulled.design.force_N.lo == pytest.approx(-pressed.design.force_N.hi)
    assert pulled.design.stress_MPa.lo == pytest.approx(pressed.design.stress_MPa.lo)
    rules = [
        next(
            mark
            for mark in one.charts()["design"].panels[0].marks
            if type(mark) is Rule
        )
        for one in (pressed, pulled)
    ]
    assert [rule.at for rule in rules] == [70.0, -70.0]


@pytest.mark.parametrize(
    ("vary", "changed", "words"),
    [
        ({}, {}, "no size is varied"),
        ({"wal_thickness_mm": (0.5, 0.6)}, {}, "Did you mean 'wall_thickness_mm'"),
        ({"load_height_mm": (50.0, 60.0)}, {}, "has no influence under the theory"),
        (WALL, {"limit_force": -60.0}, "-60 N is not plausible: 0.4 mm needs"),
        ({"wall_thickness_mm": (0.6, 0.5)}, {}, "0.6:0.5 is empty"),
        (WALL, {"limit_stress": 0.0}, "0 MPa does not lie between"),
        (WALL, {"limit_force": 120_000.0}, "is not plausible: 0.4 mm needs"),
        (WALL, {"tolerances": {"wall_thickness_mm": 0.5}}, "is too large for 0.68 mm"),
        (
            {"wall_thickness_mm": (0.65, 0.8)},
            {"limit_force": 40.0},
            "no design keeps 40",
        ),
    ],
)
def test_bad_input_is_refused(vary, changed, words):
    with pytest.raises(InputError) as refused:
        inverse_design(known(), vary, **{"limit_force": 60.0, **changed})
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(inverse_design).parameters}
