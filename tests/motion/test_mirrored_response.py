"""A gear that is pulled moves as the mirror image of one that is pressed."""

from dataclasses import replace

import numpy as np
import pytest
from mirrored import mirrored_case
from moving import TRUTH, still_posterior
from slices import slice_of

from hdcal import respond
from hdcal.errors import InputError

SMALL = {"points": 101, "draws": 50}
KNOWN = {"mass": TRUTH["mass"], "damping": 3e-3}
EFFECTS = {
    "progressive_stiffening.slope": 0.4,
    "coulomb_friction.force": 2.0,
    "seating_slack.clearance": 0.01,
}
RAMP = np.array([0.0, 0.005, 0.02])
DRIVES = {
    "step": ("step", {"duration": 0.02}),
    "sine": ("sine", {"frequency": 100.0, "duration": 0.02}),
    "table": (None, {}),
}


def moved(sense: int, name: str):
    """Return the response to a force of a sense, calibrated in that sense."""
    posterior = still_posterior(EFFECTS, K=0.05)
    if sense < 0:
        posterior = replace(posterior, case=mirrored_case(posterior.case))
    drive, options = DRIVES[name]
    if drive is None:
        drive = (RAMP, sense * np.array([0.0, 80.0, 130.0]))
    else:
        options = options | {"amplitude": sense * 80.0}
    return respond(posterior, drive, **options, **KNOWN, **SMALL)


@pytest.mark.parametrize("name", slice_of(DRIVES, ["step"]))
def test_the_motion_is_mirrored(name: str):
    found, other = moved(1, name), moved(-1, name)
    np.testing.assert_allclose(other.force_N, -found.force_N, rtol=1e-12)
    for end, source in (("lo", "hi"), ("median", "median"), ("hi", "lo")):
        expected = -getattr(found, f"deformation_{source}_mm")
        got = getattr(other, f"deformation_{end}_mm")
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-12)
    assert np.array_equal(found.tested, other.tested) and found.tested[0]
    assert other.tested.any() and not other.tested.all()
    assert {n: e["driven_by"] for n, e in found.estimates.items()} == {
        n: e["driven_by"] for n, e in other.estimates.items()
    }
    for quantity, estimate in found.estimates.items():
        for end in ("median", "lo", "hi"):
            got = other.estimates[quantity][end]
            assert got == pytest.approx(estimate[end], rel=1e-9)
    assert len(found.remarks) == len(other.remarks)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_force_that_folds_the_gear_is_refused_in_either_sense(sense: int):
    with pytest.raises(InputError, match="even at rest"):
        respond(still_posterior(), "step", amplitude=sense * 1e6, **KNOWN, **SMALL)
