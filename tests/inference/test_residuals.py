"""Shapes in residuals are found when they are there, and seldom when they are not."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import cycles
from scipy import stats
from short import SHORT

from hdcal.calibration.calibrate import calibrate
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder
from hdcal.inference.residual_shapes import (
    FALSE_ALARM,
    Whitened,
    find_structure,
    shapes_of,
)
from hdcal.inference.residuals import residuals

SIZE_OF_SHAPE = 6.0


# Time that is not just the order of the rows.
RECORDS = replace(cycles(96), time=np.arange(96.0) ** 2)


def whitened(error: np.ndarray) -> Whitened:
    """Return what an offset and a slope leave of the error, in noise sds."""
    deformation = np.asarray(RECORDS.deformation)
    absorbed = np.column_stack([np.ones(len(error)), deformation])
    return Whitened(error, absorbed, shapes_of(RECORDS, 20.0))


@pytest.mark.parametrize("name", shapes_of(RECORDS, 20.0))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_shape_is_found_with_its_sign(name, sign):
    rng = np.random.default_rng(1)
    column, up, down = shapes_of(RECORDS, 20.0)[name]
    column = column - column.mean()
    noise = rng.normal(size=96)
    shape = sign * SIZE_OF_SHAPE * column / column.std()
    found = find_structure(whitened(noise + shape), np.ones(96))
    assert found[0].name == name
    assert (up if sign > 0 else down) in found[0].words


def test_noise_raises_few_false_alarms():
    rng = np.random.default_rng(2)
    alarms = sum(
        bool(find_structure(whitened(rng.normal(size=96)), np.ones(96)))
        for _ in range(1000)
    )
    assert stats.binomtest(alarms, 1000, FALSE_ALARM, "greater").pvalue > 1e-3


def test_what_the_priors_allow_is_absorbed_and_no_more():
    """A shape along a parameter is found only beyond that parameter's prior."""
    rng = np.random.default_rng(3)
    data = whitened(rng.normal(size=96) + np.asarray(cycles(96).sense))
    column = np.asarray(cycles(96).sense)
    for prior_sd, expected in ((1e-4, True), (1e4, False)):
        with_prior = Whitened(
            residual=np.append(data.residual, 0.0),
            absorbed=np.vstack(
                [
                    np.column_stack([data.absorbed, column * prior_sd]),
                    [0.0, 0.0, 1.0],
                ]
            ),
            shapes={n: (np.append(c, 0.0), *w) for n, (c, *w) in data.shapes.items()},
        )
        found = [shape.name for shape in find_structure(with_prior, np.ones(96))]
        assert ("direction" in found) is expected


def test_the_article_s_data_bend_upwards():
    left = residuals(calibrate(read_case(datasets_folder() / "xb1-100-80"), **SHORT))
    assert [shape.name for shape in left.structure] == ["curvature"]
    assert "convex" in left.structure[0].words
    assert left.structure[0].p_value < 1e-3


def test_thermal_demo_needs_its_effect():
    case = read_case(datasets_folder() / "thermal-demo")
    without = calibrate(case, **SHORT)
    assert [s.name for s in residuals(without).structure] == ["temperature"]
    effect = calibrate(case, effects=["thermal_zero_drift"], **SHORT)
    assert residuals(effect).structure == ()
    truth = {
        "K": 2.5,
        "alpha": 3.2e-4,
        "force_offset": 1.5,
        "deformation_offset": 0.004,
        "sigma": 0.4,
        "thermal_zero_drift.slope": 0.12,
    }
    for name, value in truth.items():
        low, high = np.quantile(effect.draws[name], [0.025, 0.975])
        assert low < value < high, name
