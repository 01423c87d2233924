"""Gauge R&R against the formulas of the handbook."""

import math

import numpy as np
import pytest

from hdcal.fleets.gauge import GaugeRR, gauge_rr

DRAWS = {
    "stiffness": 200.0,
    "specimen_sd": 0.03,
    "run_offset_sd": 0.6,
    "sigma": 0.5,
    "noise_spread": 0.0,
}


def of(deformation=0.5, tolerance=None, **more) -> GaugeRR:
    draws = {name: np.full(9, value) for name, value in {**DRAWS, **more}.items()}
    return gauge_rr(draws, deformation, tolerance)


def test_shares_are_those_of_standard_deviations():
    found = of(tolerance=20.0)
    gauge, gears = math.hypot(0.6, 0.5), 0.03 * 200.0 * 0.5
    study = 100.0 * gauge / math.hypot(gauge, gears)
    assert found.percent_study_variation.median == pytest.approx(study)
    assert found.percent_tolerance is not None
    assert found.percent_tolerance.hi == pytest.approx(600.0 * gauge / 20.0)
    assert found.distinct_categories.lo == math.floor(1.41 * gears / gauge) == 5
    assert of().percent_tolerance is None
    assert of(-0.5).gears_N == found.gears_N


def test_lots_belong_to_the_gears_and_operators_and_rigs_to_the_gauge():
    found = of(lot_sd=0.04, operator_sd=0.8)
    assert found.gears_N.median == pytest.approx(0.05 * 200.0 * 0.5)
    assert found.reproducibility_N.median == pytest.approx(1.0)
    # A gain is a share of the force.
    rigs = of(operator_sd=0.8, rig_sd=0.02)
    assert rigs.reproducibility_N.median == pytest.approx(math.hypot(1.0, 2.0))
    assert rigs.gears_N == of().gears_N
    # The mean square of lognormal noise.
    noisy = of(noise_spread=0.5)
    assert noisy.repeatability_N.median == pytest.approx(0.5 * math.exp(0.25))
