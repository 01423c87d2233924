"""The sizes keep the limits with the least change, as algebra gives them."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from designs import bent, known

from hdcal.design.inverse_design import inverse_design as module
from hdcal.design.inverse_design.inverse_design import inverse_design
from hdcal.design.inverse_design.nearest_point import nearest_kept
from hdcal.design.sizes import geometry_with
from hdcal.errors import InputError
from hdcal.physics.profile import peak_stress
from hdcal.physics.registry import EFFECTS
from hdcal.report.chart_spec import Band, Points, Rule

WALL, RADIUS = {"wall_thickness_mm": (0.4, 0.9)}, {"radius_mm": (32.0, 50.0)}


@pytest.fixture
def given(monkeypatch):
    """Let draws stand in for a calibration."""

    def use(draws):
        monkeypatch.setattr(module, "design_draws", lambda source, seed: draws)
        return draws

    return use


def kept_force(draws, probability=0.99, at=0.4):
    stiffness = draws.values["K"] * draws.values["E0"] * draws.problem.unit_stiffness
    rank = int(np.ceil(probability * draws.size)) - 1
    return float(np.sort(stiffness * at)[rank])


def test_one_size_is_the_cube_root(given):
    draws = given(known(2000))
    found = inverse_design(draws.gear, WALL, 60.0)
    wall = 0.68 * (60.0 / kept_force(draws)) ** (1.0 / 3.0)
    assert found.design.sizes["wall_thickness_mm"] == pytest.approx(wall, rel=1e-7)
    assert found.design.force_N.kept == pytest.approx(60.0, rel=1e-6)
    assert 0.99 <= found.design.probability < 0.991
    assert found.tested.force_N.kept == pytest.approx(kept_force(draws), rel=1e-12)
    assert found.elasticities["wall_thickness_mm"] == pytest.approx(3.0)
    assert found.elasticities["radius_mm"] == pytest.approx(-3.0)


def test_several_sizes_change_along_the_gradient(given):
    """Least Σ (ln x/x₀)² on 3 ln δ − 3 ln R + ln L = const is along (3, −3, 1)."""
    draws = given(known(2000))
    free = WALL | RADIUS | {"length_mm": (63.0, 90.0)}
    found = inverse_design(draws.gear, free, 60.0)
    steps = np.log(np.array(list(found.design.sizes.values())) / [0.68, 40.0, 70.0])
    needed = np.log(60.0 / kept_force(draws))
    expected = needed * np.array([3.0, -3.0, 1.0]) / 19.0
    np.testing.assert_allclose(steps, expected, rtol=1e-5)
    assert found.design.change == pytest.approx(abs(needed) / np.sqrt(19.0), rel=1e-6)


def test_at_a_bound_the_other_size_changes_more(given):
    draws = given(known(2000))
    free = {"wall_thickness_mm": (0.66, 0.9)} | RADIUS
    sizes = inverse_design(draws.gear, free, 60.0).design.sizes
    assert sizes["wall_thickness_mm"] == pytest.approx(0.66, rel=1e-9)
    left = np.log(60.0 / kept_force(draws)) - 3.0 * np.log(0.66 / 0.68)
    assert sizes["radius_mm"] == pytest.approx(40.0 * np.exp(-left / 3.0), rel=1e-6)


def test_with_an_effect_the_change_is_the_least(given):
    draws = given(bent(400))
    found = inverse_design(draws.gear, WALL | RADIUS, 60.0, probability=0.95)
    assert found.design.probability >= 0.95
    # The effect changes the force of every draw by a factor without sizes.
    needed = np.log(60.0 / found.tested.force_N.kept)
    assert found.design.change == pytest.approx(abs(needed) / np.sqrt(18.0), rel=1e-5)


def test_nothing_changes_where_the_limit_is_kept_already(given):
    draws = given(known(2000))
    found = inverse_design(draws.gear, WALL | RADIUS, 500.0)
    assert found.design.change == 0.0
    assert found.design.probability == 1.0 - 0.5 / 2000
    assert found.as_tested


def test_the_coldest_temperature_decides(given):
    draws = given(known(2000))
    mild = inverse_design(draws.gear, WALL, 60.0, temperatures=[20.0])
    cold = inverse_design(draws.gear, WALL, 60.0, temperatures=[-40.0, 80.0])
    ratio = (
        cold.design.sizes["wall_thickness_mm"] / mild.design.sizes["wall_thickness_mm"]
    )
    assert ratio == pytest.approx((1.0 + 60.0 * 3e-4) ** (-1.0 / 3.0), rel=1e-3)


def test_the_stress_is_limited_too(given):
    """The force alone would have a thicker wall than the stress allows."""
    draws = given(known(2000))
    free = inverse_design(draws.gear, WALL | RADIUS, 60.0)
    assert free.design.utilisation_kept < 0.2
    limit = 0.9 * free.design.stress_MPa.median
    tight = inverse_design(draws.gear, WALL | RADIUS, 60.0, limit_stress=limit)
    assert tight.design.utilisation_kept == pytest.approx(1.0, rel=1e-5)
    assert tight.design.change > free.design.change
    sizes = geometry_with(draws.gear.geometry, tight.design.sizes)
    assert float(peak_stress(sizes, 207e3, 0.4)) == pytest.approx(limit, rel=1e-6)


def test_the_material_with_the_least_change_is_chosen(given):
    draws = given(known(2000))
    among = ["40CrNiMoA", "Ti-6Al-4V"]
    found = inverse_design(draws.gear, WALL, 60.0, materials=among)
    assert [one.material for one in found.candidates] == among
    assert all(one.met for one in found.candidates)
    # Titanium is soft enough at the tested sizes; no size has to change.
    assert found.design.material == "Ti-6Al-4V"
    assert found.design.change == 0.0
    assert any("handbook" in words for words in found.assumptions)
    frame = found.to_frame()
    assert frame.material.tolist() == among
    kept = [one.force_N.kept for one in found.candidates]
    assert frame.force_kept_N.tolist() == kept
    walls = [one.sizes["wall_thickness_mm"] for one in found.candidates]
    assert frame.wall_thickness_mm.tolist() == walls


def test_effects_of_unloading_are_an_assumption(given):
    draws = given(known(2000))
    plain = inverse_design(draws.gear, WALL, 60.0)
    friction = replace(draws.problem, effects=(EFFECTS["coulomb_friction"],))
    changed = {"source": replace(draws, problem=friction)}
    more = set(plain.model_copy(update=changed).assumptions) - set(plain.assumptions)
    assert any("unloaded" in words for words in more)


def test_the_finding_has_the_best_numbers(given):
    draws = given(known(2000))
    with pytest.raises(InputError) as refused:
        inverse_design(draws.gear, {"wall_thickness_mm": (0.65, 0.8)}, 40.0)
    words = str(refused.value)
    assert "no wall thickness between 0.65 and 0.8 mm meets 40 N at 0.4 mm" in words
    best = kept_force(draws) * (0.65 / 0.68) ** 3
    assert f"the best (wall thickness 0.65 mm) gives {best:.4g} N" in words


def test_the_nearest_point_of_two_straight_limits():
    bounds = np.array([[-1.0, 1.0], [-1.0, 1.0]])
    slopes = np.array([[1.0, 0.0], [0.0, 1.0]])

    def excess(z):
        return slopes @ z + np.array([0.5, 2.0])

    found = nearest_kept(excess, lambda z: slopes, np.zeros(2), bounds)
    # The second limit cannot be kept: as near to it as the bounds allow.
    assert found[1] == pytest.approx(-1.0)
    with_room = nearest_kept(
        lambda z: excess(z) - np.array([0.0, 1.5]),
        lambda z: slopes,
        np.zeros(2),
        bounds,
    )
    np.testing.assert_allclose(with_room, [-0.5, -0.5], atol=1e-6)


@pytest.mark.parametrize("sense", [1, -1])
def test_the_chart_shows_limit_and_choice(given, sense):
    draws = given(known(400))
    asked = {"deformation": sense * 0.4, "probability": 0.9}
    found = inverse_design(draws.gear, WALL | RADIUS, 60.0, **asked)
    charts = found.charts()
    assert list(charts) == ["design", "profile"]
    for panel in charts["design"].panels:
        marks = {type(mark): mark for mark in panel.marks[:-1]}
        assert marks[Rule].at == sense * 60.0
        assert marks[Points].y == pytest.approx(sense * 60.0, rel=1e-5)
        band = marks[Band]
        assert np.all(sense * band.low > 0.0) and np.all(band.low < band.high)
    among = {"materials": ["steel", "PEEK"], "probability": 0.9}
    assert list(inverse_design(draws.gear, {}, 90.0, **among).charts()) == ["profile"]


@pytest.mark.parametrize(
    ("vary", "changed", "words"),
    [
        ({}, {}, "nothing may change"),
        ({"wal_thickness_mm": (0.5, 0.6)}, {}, "Did you mean 'wall_thickness_mm'"),
        ({"wall_thickness_mm": (0.6, 0.5)}, {}, "0.6:0.5 is empty"),
        (WALL, {"limit_force": -1.0}, "-1 N is no limit of the force at 0.4 mm"),
        (WALL, {"limit_force": 0.0}, "0 is no limit"),
        (WALL, {"limit_force": 120_000.0}, "takes about 70.2 N. Give it in N"),
        (WALL, {"limit_force": 0.06}, "takes about 70.2 N. Give it in N"),
        (WALL, {"limit_stress": 0.0}, "0 MPa does not lie between"),
        (
            {"wall_thickness_mm": (0.1, 0.6)},
            {"tolerances": {"wall_thickness_mm": 0.2}},
            "0.2 is no tolerance of 0.1 mm",
        ),
    ],
)
def test_bad_input_is_refused(given, vary, changed, words):
    draws = given(known(2000))
    asked = {"limit_force": 60.0, **changed}
    with pytest.raises(InputError) as refused:
        inverse_design(draws.gear, vary, **asked)
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(inverse_design).parameters}
