"""K·E₀ is what the data identify: E₀'s prior moves K, not their product."""

import numpy as np
import pytest
from rigs import make_case, make_gear
from short import SHORT

from hdcal.calibration.calibrate import calibrate
from hdcal.calibration.calibration import K_by_theory
from hdcal.data.priors import Prior
from hdcal.data.reading import read_case
from hdcal.data.resources import datasets_folder

# Medians and widths to a few parts in a hundred take more draws than the checks.
LONGER = SHORT | {"draws": 4000}


def width(values):
    low, high = np.quantile(values, [0.025, 0.975])
    return high - low


@pytest.mark.thorough
def test_a_wider_modulus_prior_widens_K_only():
    case = read_case(datasets_folder() / "xb1-100-80")
    wide_gear = make_gear(E0=Prior("normal", (207e3, 30e3)), resolution=0.98)
    narrow_gear = make_gear(E0=Prior("normal", (207e3, 3e3)), resolution=0.98)
    narrow, wide = (
        calibrate(make_case(case.records, gear), **LONGER).draws
        for gear in (narrow_gear, wide_gear)
    )
    product = [width(d["K"] * d["E0"]) for d in (narrow, wide)]
    assert abs(product[1] / product[0] - 1.0) < 0.05
    assert width(wide["K"]) > 2.0 * width(narrow["K"])


@pytest.mark.thorough
def test_every_theory_reads_one_posterior():
    case = read_case(datasets_folder() / "xb1-100-80")
    by_ring = calibrate(case, **LONGER)
    by_article = calibrate(case, theory="article", **LONGER)
    for first, second in zip(
        K_by_theory(by_ring).values(), K_by_theory(by_article).values(), strict=True
    ):
        assert abs(first.median / second.median - 1.0) < 0.005
    slope = by_ring.draws["stiffness"]
    low, high = np.quantile(slope, [0.025, 0.975])
    assert low < 209.41 < high
    assert abs(np.median(slope) - 209.41) < 1.5
    article = K_by_theory(by_ring)["article"]
    assert article.lo < 0.1289 * 210.0 / 207.0 < article.hi
