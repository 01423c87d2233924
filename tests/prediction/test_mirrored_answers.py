"""Mirrored data and a mirrored request have the mirrored answer."""

import numpy as np
import pytest
from mirrored import mirrored
from posteriors import (
    batch,
    plain_draws,
    ramp_case,
    single,
    stiffer,
    with_discrepancy,
    written_posterior,
)
from rigs import make_gear
from slices import slice_of

import hdcal
from hdcal.errors import InputError
from hdcal.prediction.margin.result import Margin

SIZE = 200


def looped(size: int = SIZE, **sizes: float):
    """Return one gear, loaded and unloaded, with effects of these parameters."""
    case = ramp_case(known={"unloading", "temperature"}, sense=np.tile([1.0, -1.0], 15))
    given = {name.replace("__", "."): np.full(size, v) for name, v in sizes.items()}
    effects = dict.fromkeys(name.partition(".")[0] for name in given)
    return written_posterior(case, plain_draws(case, size) | given, effects=effects)


def friction():
    loop = {"hysteresis__force": 4.0, "hysteresis__reach": 0.05}
    return looped(coulomb_friction__force=2.0, **loop)


def two_models():
    gears = batch(6, SIZE)
    return [(3.0, gears), (1.0, stiffer(gears, 1.1))]


def numbers(found: Margin) -> list[float]:
    """Return the numbers of a margin, as those of a gear that is pressed."""
    sign = found.loading_sense

    def span(low, high):
        return (low, high) if sign > 0 else (-high, -low)

    listed = [sign * found.estimate_N, found.combined_standard_uncertainty_N]
    for level in found.levels:
        listed += [level.tested, level.capacity_N, level.capacity_median_N]
        listed += span(level.lower_bound_N, level.upper_bound_N)
        for one in (level.force_N, level.member_N):
            listed += [sign * one.median, *span(one.lo, one.hi)]
        if (risk := level.exceedance) is not None:
            listed += [risk.probability, risk.error, risk.lo, risk.hi, risk.beta]
    for row in found.budget:
        listed += [row.contribution_N, row.standard_uncertainty]
    if (reached := found.reached) is not None:
        listed += [sign * reached.median_mm, *span(reached.lo_mm, reached.hi_mm)]
        listed += span(reached.lower_bound_mm, reached.upper_bound_mm)
    if (decision := found.decision) is not None:
        listed += [decision.guard_band_N, decision.false_accept_risk]
    return listed


def mirror(models):
    if isinstance(models, list):
        return [(share, mirrored(model)) for share, model in models]
    return mirrored(models)


AT = {"deformation": 0.4, "limit_force": 84.0}
WARM = {"temperature": [-20.0, 20.0, 80.0]}
ASKED = {
    "readings": (lambda: single(size=SIZE), AT | WARM | {"given_force": 80.0}),
    "rounded": (lambda: single(make_gear(resolution=0.98), SIZE), AT),
    "tolerances": (
        lambda: single(size=SIZE),
        AT | {"tolerances": {"wall_thickness_mm": 0.02}},
    ),
    "specimens": (lambda: batch(6, SIZE), AT | WARM | {"given_force": 80.0}),
    "averaged": (two_models, AT | {"given_force": 80.0}),
    "discrepancy": (
        lambda: with_discrepancy(SIZE),
        AT | {"deformation": 0.58, "limit_force": 118.0},
    ),
    "unloading": (friction, AT | {"direction": "down", "given_force": 80.0}),
    "drifting zero": (lambda: looped(thermal_zero_drift__slope=0.1), AT | WARM),
}
QUICK = ("rounded", "averaged", "discrepancy", "unloading")


@pytest.mark.parametrize("name", slice_of(ASKED, QUICK))
def test_the_margin_is_mirrored(name: str):
    make, asked = ASKED[name]
    models, other = make(), asked | {"deformation": -asked["deformation"]}
    if "given_force" in asked:
        other["given_force"] = -asked["given_force"]
    found = hdcal.margin(models, **asked)
    pulled = hdcal.margin(mirror(models), **other)
    assert (found.loading_sense, pulled.loading_sense) == (1, -1)
    assert pulled.worst.lower_bound_N < pulled.worst.upper_bound_N < 0.0
    assert found.worst.capacity_N > 0.0 and found.worst.exceedance.probability > 0.0
    np.testing.assert_allclose(numbers(pulled), numbers(found), rtol=1e-9, atol=1e-12)
    names = [[row.component for row in one.budget] for one in (found, pulled)]
    assert names[0] == names[1]
    if "given_force" in asked:
        assert pulled.reached.lower_bound_mm < pulled.reached.upper_bound_mm < 0.0


def test_a_capacity_is_a_size_or_has_the_sign_of_the_force():
    pressed = single(size=SIZE)
    pulled = mirrored(pressed)
    size, signed = (
        hdcal.margin(pulled, -0.4, limit_force=limit) for limit in (70.0, -70.0)
    )
    assert size.to_dict() == signed.to_dict() and size.limit_force_N == 70.0
    assert size.worst.exceedance.probability > 0.999
    with pytest.raises(InputError) as refused:
        hdcal.margin(pressed, 0.4, limit_force=-70.0)
    assert [finding.where for finding in refused.value.findings] == ["limit_force"]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_loading_is_that_of_the_gear_and_not_of_the_gauge(sign: int):
    """Where the unloaded gear reads 0.1 mm, a reading of 0.05 mm pulls it."""
    posterior = single(size=SIZE)
    shifted = {
        **posterior.draws,
        "deformation_offset": posterior.draws["deformation_offset"] + 0.1,
    }
    posterior = written_posterior(posterior.case, shifted)
    posterior = posterior if sign > 0 else mirrored(posterior)
    senses = [hdcal.margin(posterior, sign * at).loading_sense for at in (0.05, 0.15)]
    assert senses == [-sign, sign]


# --- bands ---

ENDS = (("lo", "hi"), ("median", "median"), ("hi", "lo"))
TURNED = {"up": "down", "down": "up"}


@pytest.mark.parametrize("way", TURNED)
@pytest.mark.parametrize("make", [friction, lambda: with_discrepancy(SIZE)])
def test_the_bands_are_mirrored(make, way: str):
    known, at = make(), np.array([-0.1, 0.1, 0.4, 0.6])
    found = hdcal.predict(known, at, [20.0, 60.0], way)
    other = hdcal.predict(mirrored(known), -at, [20.0, 60.0], TURNED[way])
    np.testing.assert_allclose(other.deformation_mm, -found.deformation_mm)
    assert [TURNED[way] for way in other.direction] == found.direction.tolist()
    assert np.array_equal(other.tested, found.tested)
    for kind in ("physics", "with_gap"):
        for end, source in ENDS:
            got = getattr(other, f"{kind}_{end}_N")
            expected = -getattr(found, f"{kind}_{source}_N")
            np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)
    loaded = 1.0 if way == "up" else -1.0
    assert found.tested.any() == (loaded in known.case.records.sense)
