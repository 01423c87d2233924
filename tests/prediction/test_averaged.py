"""Bands over several models are those of their pooled draws."""

import numpy as np
import pytest
from posteriors import single, stiffer

from hdcal.prediction.bands.bands import default_bands, predict

TAILS = np.array([0.025, 0.5, 0.975])


@pytest.fixture(scope="module")
def posterior():
    return single()


def test_one_model_keeps_its_bands(posterior):
    alone, averaged_one = default_bands(posterior), default_bands([(1.0, posterior)])
    for name, column in alone.columns().items():
        np.testing.assert_array_equal(column, averaged_one.columns()[name])


def test_a_model_with_itself_changes_little(posterior):
    alone = default_bands(posterior)
    both = default_bands([(0.3, posterior), (0.7, posterior)])
    width = alone.new_measurement_hi_N - alone.new_measurement_lo_N
    for end in ("lo", "median", "hi"):
        name = f"new_measurement_{end}_N"
        change = np.abs(getattr(both, name) - getattr(alone, name))
        assert np.max(change / width) < 0.02
    # No member has a leftover: the mixture has none either.
    assert np.isnan(both.with_gap_median_N).all()


def test_a_mixture_is_that_of_pooled_draws():
    one, at = single(), 0.5
    other = stiffer(one, 1.05)
    found = predict([(0.8, one), (0.2, other)], [at])
    each = [
        p.draws["stiffness"] * (at - p.draws["deformation_offset"])
        + p.draws["force_offset"]
        for p in (one, other)
    ]
    expected = np.quantile(np.concatenate([*[each[0]] * 4, each[1]]), TAILS)
    ends = [getattr(found, f"physics_{end}_N")[0] for end in ("lo", "median", "hi")]
    np.testing.assert_allclose(ends, expected, atol=0.01)
    # The average of both models' own quantiles is something else.
    wrong = 0.8 * np.quantile(each[0], 0.975) + 0.2 * np.quantile(each[1], 0.975)
    assert abs(wrong - expected[2]) > 1.0
