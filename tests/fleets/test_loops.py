"""A loop that some gears have is a loop: no noise, no change, nothing of the others."""

import numpy as np
import pytest

import hdcal
from hdcal.fleets.misfit import misfit
from hdcal.fleets.over_time import time_answer, time_series
from hdcal.fleets.own_shapes import own_shapes
from hdcal.fleets.summary import gear_columns

UP = np.linspace(0.05, 0.4, 8)
X, WAY = np.r_[UP, UP[-2::-1]], np.repeat([1.0, -1.0], [8, 7])
GEARS, NOISE, LOOP = 24, 0.3, 1.6
# Gears with a loop were measured last; one of the others is read with twice the noise,
# another one in kilonewtons.
LOOPED, NOISY, OTHER_UNIT = np.arange(GEARS) >= 14, 3, 5


def looped(seed: int, other_unit: bool = False):
    rng = np.random.default_rng(seed)
    gear, run, row = (i.ravel() for i in np.indices((GEARS, 2, len(X))))
    stiffness = 210.0 * (1.0 + 0.012 * rng.standard_normal(GEARS))
    force = stiffness[gear] * X[row] + 0.7 * rng.standard_normal((GEARS, 2))[gear, run]
    force += 0.5 * LOOP * WAY[row] * LOOPED[gear]
    sd = NOISE * np.where(gear == NOISY, 2.0, 1.0)
    force += sd * rng.standard_normal(len(force))
    if other_unit:
        force = np.where(gear == OTHER_UNIT, 1e-3 * force, force)
    days = np.datetime64("2026-03-02") + np.arange(GEARS)
    table = {
        "specimen": np.array([f"G{one:02}" for one in range(GEARS)])[gear],
        "run": run,
        "date": days[gear].astype(str),
        "deformation_mm": X[row],
        "force_N": force,
    }
    return hdcal.fleet(hdcal.read_case(table, theory="spring"))


@pytest.fixture(scope="module")
def found():
    return [looped(seed) for seed in range(3)]


def test_a_loop_is_no_noise(found):
    for one in found:
        assert one.off_in["shape"].tolist() == LOOPED.tolist()
        assert not one.off_in["noise"][LOOPED].any()
        assert np.median(one.noise_sd[LOOPED]) == pytest.approx(NOISE, rel=0.15)
        assert np.median(one.own_noise_sd[LOOPED]) == pytest.approx(NOISE, rel=0.15)
    # They hide no gear that is read with twice the noise.
    assert sum(one.off_in["noise"][NOISY] for one in found) >= 2


def test_gears_with_a_loop_at_the_end_change_no_noise(found):
    for one in found:
        noise = next(t for t in time_series(one) if t.what == "noise")
        assert not time_answer(noise).changed


def test_the_loop_in_the_mean_is_that_of_all_gears(found):
    for one in found:
        assert one.misfit.loop_N == pytest.approx(LOOP * LOOPED.mean(), rel=0.2)
        # Neighbours err alike neither in those with a loop nor in those without.
        assert one.misfit.correlation == 0.0


def test_a_gear_in_another_unit_is_told_to_be():
    one = looped(0, other_unit=True)
    assert gear_columns(one)["apart_percent"][OTHER_UNIT] < -99.0


def test_a_loop_without_noise_leaves_some():
    """As of computed readings: what rounding leaves has a logarithm."""
    gear, row = (i.ravel() for i in np.indices((4, len(X))))
    force = 200.0 * X[row] + 0.5 * WAY[row] * (gear == 0)
    force += np.where(gear > 0, 0.1 * np.sin(7.0 * row + gear), 0.0)
    table = {"specimen": np.char.add("G", gear.astype(str)), "force_N": force}
    case = hdcal.read_case(table | {"deformation_mm": X[row]}, theory="spring")
    found = own_shapes(case)
    assert found.loop[0] == pytest.approx(1.0)
    assert 0.0 < found.noise_ratio[0] < 1e-3
    assert np.all(found.noise_ratio[1:] > 0.1)
    one = misfit(case, 0.1 * found.noise_ratio, found.clear)
    assert np.isfinite([one.correlation, one.loop_N, one.bend_N]).all()
