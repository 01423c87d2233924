"""Gauge R&R against the handbook's formulas, written down by hand."""

import math

import numpy as np
import pytest

from hdcal.fleets.gauge import gauge

DRAWS = {
    "stiffness": 200.0,
    "specimen_sd": 0.03,
    "run_offset_sd": 0.6,
    "sigma": 0.5,
    "noise_spread": 0.0,
}


def of(deformation=0.5, tolerance=None, **more):
    draws = {name: np.full(9, value) for name, value in {**DRAWS, **more}.items()}
    return gauge(draws, deformation, tolerance)


def test_shares_are_those_of_the_standard_deviations():
    found = of(tolerance=20.0)
    of_gauge, gears = math.hypot(0.6, 0.5), 0.03 * 200.0 * 0.5
    total = math.hypot(of_gauge, gears)
    assert found.percent_study_variation.median == pytest.approx(
        100.0 * of_gauge / total
    )
    assert found.percent_tolerance is not None
    assert found.percent_tolerance.hi == pytest.approx(600.0 * of_gauge / 20.0)
    assert found.distinct_categories.lo == math.floor(1.41 * gears / of_gauge) == 5
    assert of().percent_tolerance is None
    assert of(-0.5).gears_N == found.gears_N


def test_lots_count_with_the_gears_operators_and_rigs_with_the_gauge():
    found = of(lot_sd=0.04, operator_sd=0.8)
    assert found.gears_N.median == pytest.approx(0.05 * 200.0 * 0.5)
    assert found.reproducibility_N.median == pytest.approx(1.0)
    # A gain is a share of the force.
    rigs = of(operator_sd=0.8, rig_sd=0.02)
    assert rigs.reproducibility_N.median == pytest.approx(math.hypot(1.0, 2.0))
    assert rigs.gears_N == of().gears_N
    # Noise that differs from gear to gear counts by its mean square.
    noisy = of(noise_spread=0.5)
    assert noisy.repeatability_N.median == pytest.approx(0.5 * math.exp(0.25))
