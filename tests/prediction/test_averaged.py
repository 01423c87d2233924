"""Bands over several models are those of their pooled draws."""

from dataclasses import replace

import numpy as np
import pytest
from rigs import make_case, ramp

from hdcal.calibration.calibrate import calibrate
from hdcal.prediction import averaged_bands as averaged
from hdcal.prediction.averaged_bands import averaged_bands
from hdcal.prediction.bands.bands import default_bands


@pytest.fixture(scope="module")
def posterior():
    records = ramp(14)
    noise = np.random.default_rng(3).normal(0.0, 0.8, 14)
    force = 200.0 * records.deformation + noise
    case = make_case(replace(records, force=force))
    return calibrate(case, warmup=300, draws=300)


def test_one_model_keeps_its_bands(posterior):
    alone, averaged_one = default_bands(posterior), averaged_bands([(1.0, posterior)])
    for name, column in alone.columns().items():
        np.testing.assert_array_equal(column, averaged_one.columns()[name])


def test_a_model_with_itself_changes_little(posterior):
    alone = default_bands(posterior)
    both = averaged_bands([(0.3, posterior), (0.7, posterior)])
    width = alone.new_measurement_hi_N - alone.new_measurement_lo_N
    for end in ("lo", "median", "hi"):
        name = f"new_measurement_{end}_N"
        change = np.abs(getattr(both, name) - getattr(alone, name))
        assert np.max(change / width) < 0.02
    # No member has a leftover: the mixture has none either.
    assert np.isnan(both.with_gap_median_N).all()


def test_a_mixture_is_that_of_pooled_draws():
    rng = np.random.default_rng(0)
    draws = rng.normal(0.0, 1.0, 200_000), rng.normal(4.0, 0.5, 200_000)
    levels = averaged._levels()
    each = [np.quantile(part, levels)[:, None] for part in draws]
    found = averaged._mixture(each, [0.8, 0.2])[:, 0]
    pooled = np.concatenate([draws[0], draws[1][:50_000]])
    expected = np.quantile(pooled, list(averaged._TARGETS.values()))
    np.testing.assert_allclose(found, expected, atol=0.1)
    # The average of both models' own quantiles is something else.
    wrong = 0.8 * np.quantile(draws[0], 0.975) + 0.2 * np.quantile(draws[1], 0.975)
    assert abs(wrong - expected[2]) > 1.0
