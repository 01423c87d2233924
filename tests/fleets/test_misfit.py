"""What straight lines leave over is told with its size, and never of pure noise."""

import numpy as np
import pytest

from hdcal.data.reading import read_case
from hdcal.fleets.misfit import misfit, misfit_words
from hdcal.fleets.own_shapes import own_shapes
from hdcal.quantities import FORCE

GEARS, UP = 20, np.linspace(0.02, 0.5, 12)
PATH = np.concatenate([UP, UP[-2::-1]])
WAYS = np.where(np.arange(len(PATH)) < len(UP), 1.0, -1.0)
SLOPES = 100.0 + 3.0 * np.random.default_rng(0).normal(size=GEARS)
NOISE = np.full(GEARS, 0.3)


def found(extra=0.0, *, correlation=0.0, seed=0, path=PATH, noise=0.3):
    """Return what is found of two runs of each gear with something beside lines."""
    rng = np.random.default_rng(seed)
    errors = rng.normal(size=(GEARS, 2, path.shape[-1]))
    for k in range(1, path.shape[-1]):
        errors[..., k] *= np.sqrt(1.0 - correlation**2)
        errors[..., k] += correlation * errors[..., k - 1]
    zeros = rng.normal(size=(GEARS, 2, 1))
    force = SLOPES[:, None, None] * path + zeros + noise * errors + extra
    gear = np.repeat(np.arange(GEARS), 2 * path.shape[-1])
    table = {
        "specimen": np.char.add("G", gear.astype(str)),
        "run": np.tile(np.repeat([1, 2], path.shape[-1]), GEARS),
        "deformation_mm": (path + 0.0 * force).ravel(),
        "force_N": force.ravel(),
    }
    case = read_case(table)
    return misfit(case, NOISE, own_shapes(case).clear)


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_of_noise_neither_a_loop_nor_a_bend_is_said(correlation):
    """Of 40 fleets; in errors taken for independent it is 10 at 0.9."""
    all_found = [found(correlation=correlation, seed=seed) for seed in range(40)]
    told = [one for one in all_found if one.loop_N or one.bend_N]
    assert len(told) <= 1
    if not correlation:
        assert not any(one.correlation for one in all_found)


def test_a_loop_has_its_width():
    one = found(0.4 * WAYS)
    assert one.loop_N == pytest.approx(0.8, abs=0.05) and one.bend_N == 0.0
    assert one.correlation == 0.0
    assert "0.8 N higher while the deformation increases" in FORCE.say(
        " ".join(misfit_words(one))
    )


@pytest.mark.parametrize("noise", [0.3, 1e-9])
def test_a_loop_in_rows_that_lie_closer_on_one_side_is_no_bend(noise):
    path = np.concatenate([0.5 * (UP / 0.5) ** 2, UP[-2::-1]])
    one = found(0.4 * WAYS, path=path, noise=noise)
    assert one.loop_N == pytest.approx(0.8, abs=0.05) and one.bend_N == 0.0


@pytest.mark.parametrize("jitter", [0.0, 3e-9, 1e-4])
def test_a_loop_that_three_readings_show_is_told_though_a_bend_looks_the_same(jitter):
    path = np.array([0.1, 0.5, 0.3]) + np.zeros((GEARS, 2, 1))
    path = path + jitter * np.random.default_rng(0).normal(size=path.shape)
    one = found(np.array([0.4, 0.4, -0.4]), path=path)
    assert one.loop_N == pytest.approx(0.8, abs=0.3) and one.bend_N == 0.0


def test_a_loop_of_gears_that_are_pulled_has_its_sign():
    assert found(-0.4 * WAYS, path=-PATH).loop_N == pytest.approx(0.8, abs=0.05)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bend_has_its_size_in_compression_and_in_tension(side):
    """Off the straight line that fits it best a parabola lies by an eighth and more."""
    path = side * UP
    curve = 8.0 * path * np.abs(path)
    line = np.polyval(np.polyfit(path, curve, 1), path)
    one = found(curve - line, path=path)
    assert one.bend_N == pytest.approx(np.ptp(curve - line), rel=0.15)
    assert "stiffens" in FORCE.say(" ".join(misfit_words(one))) and one.loop_N == 0.0


def test_a_bend_is_that_of_most_gears_not_of_the_widest_stroke():
    strokes = np.where(np.arange(GEARS) == 3, 3.0, 1.0)[:, None, None]
    path = UP * strokes * np.ones((GEARS, 2, 1))
    one = found(8.0 * path**2, path=path)
    curve = 8.0 * UP**2
    swing = np.ptp(curve - np.polyval(np.polyfit(UP, curve, 1), UP))
    assert one.bend_N == pytest.approx(swing, rel=0.15)


def test_neighbours_that_err_alike_are_told_with_what_comes_of_it():
    one = found(correlation=0.8)
    assert 0.55 < one.correlation < 0.85
    assert "too narrow" in FORCE.say(" ".join(misfit_words(one)))


def test_the_factor_is_that_of_the_means_of_long_runs():
    """Against 4,000 simulated means of 400 readings each."""
    one = found(correlation=0.8)
    rng = np.random.default_rng(1)
    errors = rng.normal(size=(4000, 400))
    for k in range(1, 400):
        fresh = np.sqrt(1.0 - one.correlation**2) * errors[:, k]
        errors[:, k] = one.correlation * errors[:, k - 1] + fresh
    assert one.widening == pytest.approx(errors.mean(axis=1).std() * 20.0, rel=0.05)
