"""Bands of mirrored data are mirrored: up, where deformation rises, becomes down."""

from dataclasses import replace

import numpy as np
import pytest
from mirrored import mirrored
from posteriors import plain_draws, ramp_case, with_leftover, written_posterior
from slices import slice_of

from hdcal.prediction.bands.bands import Bands, default_bands, predict

ENDS = (("lo", "hi"), ("median", "median"), ("hi", "lo"))
TURNED = {"up": "down", "down": "up"}


def friction():
    case = ramp_case(known={"unloading"}, sense=np.tile([1.0, -1.0], 15))
    draws = plain_draws(case, 200) | {"coulomb_friction.force": np.full(200, 2.0)}
    return written_posterior(case, draws, effects=["coulomb_friction"])


def check_mirrored(other: Bands, found: Bands, rows=slice(None)) -> None:
    """Require bands to be those of mirrored data, the rows in a given order."""
    np.testing.assert_allclose(other.deformation_mm[rows], -found.deformation_mm)
    assert [TURNED[way] for way in other.direction[rows]] == found.direction.tolist()
    assert np.array_equal(other.tested[rows], found.tested)
    for kind in ("physics", "with_gap"):
        for end, source in ENDS:
            got = getattr(other, f"{kind}_{end}_N")[rows]
            expected = -getattr(found, f"{kind}_{source}_N")
            np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("way", slice_of(TURNED, ["down"]))
@pytest.mark.parametrize("make", [friction, lambda: with_leftover(200)])
def test_the_bands_are_mirrored(make, way):
    known, at = make(), np.array([-0.1, 0.1, 0.4, 0.6])
    found = predict(known, at, [20.0, 60.0], way)
    other = predict(mirrored(known), -at, [20.0, 60.0], TURNED[way])
    check_mirrored(other, found)
    loaded = 1.0 if way == "up" else -1.0
    assert found.tested.any() == (loaded in known.case.records.sense)
    assert not found.tested.all()
    assert np.all(other.new_measurement_lo_N < other.new_measurement_hi_N)


def test_by_default_the_gear_is_loaded():
    known, at = friction(), np.array([0.0, 0.1, 0.4])
    found, other = predict(known, at), predict(mirrored(known), -at)
    assert set(found.direction) == {"up"} and set(other.direction) == {"down"}
    check_mirrored(other, found)
    assert other.tested[1:].all()


def test_the_grid_of_a_result_folder_is_mirrored():
    known = with_leftover(200)
    gear = replace(known.case.gear, nominal_deformation=None)
    known = replace(known, case=replace(known.case, gear=gear))
    found, other = default_bands(known), default_bands(mirrored(known))
    assert other.deformation_mm.min() < -0.54 and other.deformation_mm.max() == 0.0
    check_mirrored(other, found, slice(None, None, -1))
