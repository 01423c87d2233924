"""A study has every combination with its interval."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from designs import bent
from posteriors import with_leftover
from rigs import make_gear
from scipy.stats import lognorm

from hdcal.data.prior import Prior
from hdcal.design import study as module
from hdcal.design.gears import draw_gears
from hdcal.design.study import force_quantiles, study
from hdcal.errors import InputError
from hdcal.physics.theory import ring
from hdcal.report.charts.chart_spec import Line

GEAR = make_gear(
    K=Prior("lognormal", (2.2, 0.1)),
    E0=Prior("fixed", (207e3,)),
    alpha=Prior("fixed", (3e-4,)),
)
WALLS = {"wall_thickness_mm": [0.7, 0.6]}
SHARES = [0.5, 0.025, 0.975]


def test_bands_of_every_combination_are_those_of_the_prior():
    found = study(GEAR, {"wall_thickness_mm": [0.6, 0.68], "temperature_C": [20, 80]})
    prior = lognorm(0.1, scale=2.2)
    for _, row in found.to_frame().iterrows():
        sizes = replace(GEAR.geometry, wall_thickness=row["wall_thickness_mm"])
        warm = 1.0 - 3e-4 * (row["temperature_C"] - 20.0)
        unit = float(ring(sizes, 207e3)) * warm * 0.4
        for name, share in zip(("median", "lo", "hi"), SHARES, strict=True):
            # 4000 draws: the tails of the prior to about 1 %.
            expected = pytest.approx(unit * prior.ppf(share), rel=0.012)
            assert row[f"force_{name}_N"] == expected
    assert found.designs["wall_thickness_mm"].tolist() == [0.6, 0.6, 0.68, 0.68]
    assert found.designs["temperature_C"].tolist() == [20, 80] * 2
    assert {*found.designs["deformation_mm"]} == {0.4} and not found.far_sizes
    far = study(GEAR, {"wall_thickness_mm": [0.4, 0.7]}, materials=["steel", "PEEK"])
    assert far.far_sizes == {"wall_thickness_mm": 0.4} and len(far.to_frame()) == 4
    (panel,) = far.charts()["study"].panels
    assert len([mark for mark in panel.marks if isinstance(mark, Line)]) == 2


@pytest.mark.parametrize(
    "make", [lambda: bent(200), lambda: draw_gears(with_leftover(200))]
)
def test_blocks_of_designs_are_the_obvious_loop(make, monkeypatch):
    gears = make()
    random = np.random.default_rng(0)
    at, warm = random.uniform(0.1, 0.5, 7), random.choice([20.0, 80.0], 7)
    factor = random.uniform(0.5, 2.0, 7)
    slow = [
        np.quantile(gears.forces([x], [t], f), SHARES)
        for x, t, f in zip(at, warm, factor, strict=True)
    ]
    monkeypatch.setattr(module, "_BLOCK", 3 * 200)
    found = force_quantiles(gears, at, warm, factor, SHARES)
    np.testing.assert_allclose(found.T, slow, rtol=1e-9)


def test_the_forces_of_a_gear_that_is_pulled_are_negative():
    at = np.array([0.1, 0.4])
    found, other = (study(GEAR, {"deformation_mm": sign * at}) for sign in (1, -1))
    expected = -found.to_frame()[["force_hi_N", "force_lo_N"]].to_numpy()
    ends = other.to_frame()[["force_lo_N", "force_hi_N"]].to_numpy()
    np.testing.assert_allclose(ends, expected, rtol=1e-9)
    assert np.all(other.designs["stress_MPa"] > 0.0)


@pytest.mark.parametrize(
    ("vary", "changed", "words"),
    [
        ({"wall_tickness_mm": [0.6]}, {}, "Did you mean 'wall_thickness_mm'"),
        ({"wall_thickness_mm": [0.6, -1.0]}, {}, "-1 mm does not lie"),
        ({"wall_thickness_mm": [50.0]}, {}, "not thinner than the radius"),
        ({"radius_mm": [30.0]}, {"deformation": -31.0}, "reaches the radius of 30"),
        ({"load_height_mm": [50.0]}, {}, "changes nothing under the theory 'ring'"),
        ({"radius_mm": np.linspace(30, 40, 10**6)}, {}, "not between 1 and 100000"),
        ({"radius_mm": []}, {}, "0 designs"),
        ({}, {"materials": ["40CrNiMo"]}, "Did you mean '40CrNiMoA'"),
        ({}, {"temperature": -300.0}, "absolute zero"),
        ({}, {"interval": 1.0}, "does not lie between 0 and 1"),
    ],
)
def test_bad_input_is_refused(vary, changed, words):
    with pytest.raises(InputError) as refused:
        study(GEAR, vary, **changed)
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(study).parameters, "40CrNiMo.toml"}
