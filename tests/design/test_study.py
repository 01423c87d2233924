"""A study has every combination with its interval."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from rigs import make_gear
from scipy.stats import lognorm

from hdcal.data.prior import Prior
from hdcal.design.study.study import study
from hdcal.errors import InputError
from hdcal.physics.theory import cup, ring
from hdcal.report.chart_spec import Line

GEAR = make_gear(
    K=Prior("lognormal", (2.2, 0.1)),
    E0=Prior("fixed", (207e3,)),
    alpha=Prior("fixed", (3e-4,)),
)


def test_every_combination_in_order():
    found = study(GEAR, {"wall_thickness_mm": [0.6, 0.7], "radius_mm": [35, 40, 45]})
    assert found.designs["wall_thickness_mm"].tolist() == [0.6] * 3 + [0.7] * 3
    assert found.designs["radius_mm"].tolist() == [35, 40, 45] * 2
    assert set(found.designs["deformation_mm"]) == {0.4}
    assert set(found.designs["temperature_C"]) == {20.0}
    assert found.varied == ("wall_thickness_mm", "radius_mm")


def test_bands_are_those_of_the_prior():
    found = study(GEAR, {"wall_thickness_mm": [0.6, 0.68], "temperature_C": [20, 80]})
    prior = lognorm(0.1, scale=2.2)
    for row in range(4):
        wall, warm = (
            found.designs[name][row] for name in ("wall_thickness_mm", "temperature_C")
        )
        sizes = replace(GEAR.geometry, wall_thickness=wall)
        unit = float(ring(sizes, 207e3)) * (1.0 - 3e-4 * (warm - 20.0)) * 0.4
        for name, share in (("median", 0.5), ("lo", 0.025), ("hi", 0.975)):
            force = found.designs[f"force_{name}_N"][row]
            # 4000 draws: the tails of the prior to about 1 %.
            assert force == pytest.approx(unit * prior.ppf(share), rel=0.012)
    assert found.interval_kind == "equal-tailed prior interval"
    assert found.assumptions[0].startswith("Prior only")


def test_the_cup_depends_on_height_and_poissons_ratio():
    gear = replace(GEAR, theory="cup", K_theory="cup")
    heights = [50.0, 62.0, 70.0]
    force = study(gear, {"load_height_mm": heights}).designs["force_median_N"]
    stiffness = [
        float(cup(replace(GEAR.geometry, load_height=h), 207e3)) for h in heights
    ]
    np.testing.assert_allclose(force / force[0], np.array(stiffness) / stiffness[0])
    other = study(gear, {}, materials=["40CrNiMoA", "PEEK"])
    ratio = np.divide(*other.designs["force_median_N"])
    sizes = replace(GEAR.geometry, poisson=0.39)
    stiff = float(cup(GEAR.geometry, 207e3)) / float(cup(sizes, 3.8e3))
    assert ratio == pytest.approx(stiff, rel=0.02)


def test_far_sizes_have_a_warning():
    near = study(GEAR, {"wall_thickness_mm": [0.6, 0.7]})
    assert not near.warnings
    far = study(GEAR, {"wall_thickness_mm": [0.4, 0.7]})
    assert far.far_sizes == {"wall_thickness_mm": 0.4} and "0.68" in far.warnings[0]
    assert all("carried over" in " ".join(s.assumptions) for s in (near, far))


def test_the_chart_has_a_curve_for_each_combination():
    walls = {"wall_thickness_mm": [0.7, 0.6]}
    found = study(GEAR, walls, materials=["steel", "PEEK"])
    (panel,) = found.charts()["study"].panels
    lines = [mark for mark in panel.marks if isinstance(mark, Line)]
    assert [line.label for line in lines] == ["steel", "PEEK"]
    assert all(line.x.tolist() == [0.6, 0.7] for line in lines)
    (alone,) = study(GEAR, {}, materials=["steel", "PEEK"]).charts()["study"].panels
    assert alone.names == ["steel", "PEEK"]
    many = study(GEAR, walls | {"radius_mm": np.linspace(36.0, 44.0, 9)})
    (panel,) = many.charts()["study"].panels
    assert len([mark for mark in panel.marks if isinstance(mark, Line)]) == 6
    (row,) = study(GEAR, {}).rows
    assert row["force"].lo < row["force"].median == row["force_median_N"]


@pytest.mark.parametrize(
    ("vary", "changed", "words"),
    [
        ({"wall_tickness_mm": [0.6]}, {}, "Did you mean 'wall_thickness_mm'"),
        ({"wall_thickness_mm": [0.6, -1.0]}, {}, "-1 mm does not lie"),
        ({"wall_thickness_mm": [50.0]}, {}, "not thinner than the radius"),
        ({"deformation_mm": [0.2, 0.0]}, {}, "a deformation that is zero"),
        ({"deformation_mm": [-45.0]}, {}, "-45 mm on a radius of 40 mm"),
        ({"radius_mm": [30.0]}, {"deformation": 31.0}, "on a radius of 30 mm"),
        ({"load_height_mm": [50.0]}, {}, "changes nothing under the theory 'ring'"),
        ({"radius_mm": np.linspace(30, 40, 10**6)}, {}, "more than 100000"),
        ({}, {"materials": ["40CrNiMo"]}, "Did you mean '40CrNiMoA'"),
        ({}, {"materials": ["steel", "steel"]}, "one of them twice"),
        ({}, {"temperature": -300.0}, "absolute zero"),
        ({}, {"interval": 1.0}, "does not lie between 0 and 1"),
        ({"material": ["steel"]}, {}, "a varied value is no number"),
    ],
)
def test_bad_input_is_refused(vary, changed, words):
    with pytest.raises(InputError) as refused:
        study(GEAR, vary, **changed)
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(study).parameters}


def test_without_a_nominal_deformation_one_is_required():
    with pytest.raises(InputError, match="names no nominal deformation"):
        study(replace(GEAR, nominal_deformation=None), {"radius_mm": [40.0]})


def test_too_many_axes_are_refused():
    names = ("wall_thickness_mm", "radius_mm", "length_mm")
    vary = {name: [0.9, 1.0] for name in ("deformation_mm", "temperature_C")}
    for name in names:
        own = getattr(GEAR.geometry, name.removesuffix("_mm"))
        vary[name] = [0.9 * own, own]
    with pytest.raises(InputError, match="5 sizes at a time"):
        study(GEAR, vary)
