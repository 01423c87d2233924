"""The size of a gap is what the base model leaves of it, no more."""

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated

from hdcal import read_case
from hdcal.data.priors import effect_priors
from hdcal.evidence.linear_rows import remove_base, restore_base
from hdcal.evidence.prepare import prepare
from hdcal.evidence.smooth_gap import DETECTED, additive_basis, fit_smooth_gap


def test_what_is_restored_leaves_the_same():
    rows = prepare(simulated(rich()), effect_priors()).rows
    curves = np.random.default_rng(2).normal(size=(3, len(rows.reading)))
    left = remove_base(rows, curves)
    np.testing.assert_allclose(remove_base(rows, restore_base(rows, left)), left)


def sizes(effect, added, seed, floor=DETECTED):
    """Return the fitted gap over the true one: middle and ends of a 95 % interval."""
    prepared = prepare(simulated(rich(), effect, seed=seed), effect_priors())
    true = np.sqrt(np.mean(remove_base(prepared.rows, added) ** 2))
    rng = np.random.default_rng(seed)
    smooth = fit_smooth_gap(prepared, additive_basis(prepared), 0.0, rng, floor=floor)
    return np.quantile(smooth.rms, (0.5, 0.025, 0.975)) / true


def test_a_gap_that_the_modulus_could_take_in_part_is_no_larger_for_that():
    """Of ten rigs fewer than seven would hold it once in 1,000."""
    added = 0.05 * (rich().temperature - 20.0)[None]
    found = np.array(
        [sizes({"thermal_zero_drift": {"slope": 0.05}}, added, s) for s in range(10)]
    )
    assert np.median(found[:, 0]) == pytest.approx(1.0, abs=0.12)
    assert np.count_nonzero((found[:, 1] < 1.0) & (found[:, 2] > 1.0)) >= 7


@pytest.mark.thorough
def test_a_gap_of_half_the_noise_is_no_larger_for_what_is_looked_for_in_vain():
    """Components that are not there add up: a prior scale of 0.3 shows what they do."""
    kelvins = (rich().temperature - 20.0)[None]
    rows = prepare(simulated(rich()), effect_priors()).rows
    slope = 0.5 * NOISE / np.sqrt(np.mean(remove_base(rows, kelvins) ** 2))
    drift = {"thermal_zero_drift": {"slope": slope}}
    middles = [
        np.median([sizes(drift, slope * kelvins, s, floor)[0] for s in range(12)])
        for floor in (DETECTED, 0.3)
    ]
    assert middles[0] == pytest.approx(1.0, abs=0.15)
    assert middles[1] > 1.15


def test_rows_that_the_gap_nearly_interpolates_are_fitted():
    """More functions than rows: the noise of some draws falls to nearly nothing."""
    force = [0.5, 12.1, 22.0, 33.4, 42.5, 53.7, 41.6, 30.0, 20.9, 9.6, -1.2]
    columns = {"deformation_mm": [0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0], "force_N": force}
    prepared, rng = (
        prepare(read_case(columns), effect_priors()),
        np.random.default_rng(0),
    )
    smooth = fit_smooth_gap(prepared, additive_basis(prepared), 0.0, rng)
    assert np.isfinite(smooth.rms).all() and np.min(smooth.rms) > 0.0
