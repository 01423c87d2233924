"""What straight lines leave over is told with its size, and never of pure noise."""

import numpy as np
import pytest

from hdcal.data.reading import read_case
from hdcal.fleets.misfit import misfit, misfit_words

GEARS, UP = 20, np.linspace(0.02, 0.5, 12)
PATH = np.concatenate([UP, UP[-2::-1]])
SLOPES = 100.0 + 3.0 * np.random.default_rng(0).normal(size=GEARS)
NOISE = np.full(GEARS, 0.3)


def found(extra=0.0, *, correlation=0.0, seed=0, path=PATH):
    """Return what is found of two runs of each gear with something beside lines."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(GEARS, 2, len(path)))
    for k in range(1, len(path)):
        noise[..., k] *= np.sqrt(1.0 - correlation**2)
        noise[..., k] += correlation * noise[..., k - 1]
    zeros = rng.normal(size=(GEARS, 2, 1))
    force = SLOPES[:, None, None] * path + zeros + 0.3 * noise + extra
    gear = np.repeat(np.arange(GEARS), 2 * len(path))
    table = {
        "specimen": np.char.add("G", gear.astype(str)),
        "run": np.tile(np.repeat([1, 2], len(path)), GEARS),
        "deformation_mm": np.tile(path, 2 * GEARS),
        "force_N": force.ravel(),
    }
    return misfit(read_case(table), SLOPES, NOISE)


def test_of_noise_nothing_is_said():
    for seed in range(20):
        assert not [*misfit_words(found(seed=seed))]


def test_a_loop_has_its_width():
    loop = np.where(np.arange(len(PATH)) < len(UP), 0.4, -0.4)
    one = found(loop)
    assert one.loop_N == pytest.approx(0.8, abs=0.05) and one.bend_N == 0.0
    assert one.correlation == 0.0
    assert "0.8 N higher while the deformation increases" in " ".join(misfit_words(one))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_bend_has_its_size_in_compression_and_in_tension(side):
    """Off the straight line that fits it best a parabola lies by an eighth and more."""
    path = side * UP
    curve = 8.0 * path * np.abs(path)
    line = np.polyval(np.polyfit(path, curve, 1), path)
    one = found(curve - line, path=path)
    assert one.bend_N == pytest.approx(np.ptp(curve - line), rel=0.15)
    assert "stiffens" in " ".join(misfit_words(one)) and one.loop_N == 0.0


def test_neighbours_that_err_alike_are_told_with_what_comes_of_it():
    one = found(correlation=0.8)
    assert 0.55 < one.correlation < 0.85
    assert "too narrow" in " ".join(misfit_words(one))
    assert one.widening == pytest.approx(
        np.sqrt((1 + one.correlation) / (1 - one.correlation))
    )
