"""A study has every combination with its interval."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
from designs import bent, known
from mirrored import mirrored
from posteriors import with_discrepancy
from scipy.stats import lognorm

from hdcal.design import study as module
from hdcal.design.gears import calibrated_gears
from hdcal.design.study import force_quantiles, study
from hdcal.errors import InputError
from hdcal.physics.theory import ring
from hdcal.report.charts.chart_spec import Line

GEAR = known(4000, log_sd=0.1)
SHARES = [0.5, 0.025, 0.975]


def test_bands_of_every_combination_are_those_of_the_draws():
    found = study(GEAR, {"wall_thickness_mm": [0.6, 0.68], "temperature_C": [20, 80]})
    influence, geometry = lognorm(0.1, scale=2.2), GEAR.case.gear.geometry
    for _, row in found.to_frame().iterrows():
        sizes = replace(geometry, wall_thickness=row["wall_thickness_mm"])
        warm = 1.0 - 3e-4 * (row["temperature_C"] - 20.0)
        unit = float(ring(sizes, 207e3)) * warm * 0.4
        for name, share in zip(("median", "lo", "hi"), SHARES, strict=True):
            # 4000 draws: the tails to about 1 %.
            expected = pytest.approx(unit * influence.ppf(share), rel=0.015)
            assert row[f"force_{name}_N"] == expected
    assert found.designs["wall_thickness_mm"].tolist() == [0.6, 0.6, 0.68, 0.68]
    assert found.designs["temperature_C"].tolist() == [20, 80] * 2
    assert {*found.designs["deformation_mm"]} == {0.4} and not found.far_sizes
    varied = {"wall_thickness_mm": [0.4, 0.7], "radius_mm": [40.0, 41.0]}
    far = study(GEAR, varied)
    assert far.far_sizes == {"wall_thickness_mm": 0.4} and len(far.to_frame()) == 4
    (panel,) = far.charts()["study"].panels
    assert len([mark for mark in panel.marks if isinstance(mark, Line)]) == 2


@pytest.mark.parametrize("make", [bent, with_discrepancy])
def test_blocks_of_designs_are_the_obvious_loop(make, monkeypatch):
    gears = calibrated_gears(make(200))
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
    found, other = (
        study(one, {"deformation_mm": sign * at})
        for one, sign in ((GEAR, 1), (mirrored(GEAR), -1))
    )
    expected = -found.to_frame()[["force_hi_N", "force_lo_N"]].to_numpy()
    ends = other.to_frame()[["force_lo_N", "force_hi_N"]].to_numpy()
    np.testing.assert_allclose(ends, expected, rtol=1e-9)
    assert np.all(other.designs["stress_MPa"] > 0.0)


@pytest.mark.parametrize(
    ("vary", "changed", "words"),
    [
        ({"wall_tickness_mm": [0.6]}, {}, "Did you mean 'wall_thickness_mm'"),
        ({"wall_thickness_mm": [0.6, -1.0]}, {}, "-1 mm does not lie"),
        ({"radius_mm": []}, {}, "0 designs"),
        ({"wall_thickness_mm": [50.0]}, {}, "not less than the radius"),
        ({"radius_mm": [30.0]}, {"deformation": -31.0}, "reaches the radius of 30"),
        ({"load_height_mm": [50.0]}, {}, "has no influence under the theory 'ring'"),
        ({"radius_mm": np.linspace(30, 40, 10**6)}, {}, "1 to 100000 are possible"),
        ({}, {"temperature": -300.0}, "absolute zero"),
        ({}, {"interval": 1.0}, "does not lie between 0 and 1"),
    ],
)
def test_bad_input_is_refused(vary, changed, words):
    with pytest.raises(InputError) as refused:
        study(GEAR, vary, **changed)
    assert words in str(refused.value)
    names = {finding.file for finding in refused.value.findings}
    assert names <= {*signature(study).parameters}
