"""Readings of a position, as of a crosshead, have the answers of a deformation."""

import numpy as np
import pytest

import hdcal
from hdcal.calibration.check.check import check
from hdcal.data.case import Case, from_contact
from hdcal.prediction.bands.predict import default_bands

TRAVEL = np.linspace(0.0, 30.0, 60)
X = np.concatenate([TRAVEL, TRAVEL[::-1]])
SENSE = np.repeat([1.0, -1.0], 60)
NOISE = np.random.default_rng(11).normal(0.0, 0.05, 120)
FORCE = 4.2 * X * (1.0 + 0.0075 * SENSE) + NOISE
# The first is a deformation, the others positions of a crosshead.
ORIGINS = (0.0, -212.4, 950.0)


def position(origin: float, **gear) -> Case:
    table = {"deformation_mm": X + origin, "force_N": FORCE}
    return hdcal.read_case(table, gear=gear or None)


@pytest.mark.parametrize("origin", ORIGINS[1:])
def test_the_part_is_unloaded_where_a_line_has_no_force(origin: float):
    case = position(origin)
    assert case.gear.contact == pytest.approx(origin, abs=0.2)
    assert sum("is a position" in note for note in case.notes) == 1
    rows = check(case).data.direction
    assert rows.loading == 60
    near = from_contact(case)
    assert near.gear.contact == 0.0
    np.testing.assert_allclose(near.records.deformation, X, atol=0.2)


def test_a_deformation_or_a_zero_that_is_stated_stays():
    assert position(0.0).gear.contact == 0.0
    zero = {"family": "normal", "mean": -212.0, "sd": 0.5, "unit": "mm"}
    stated = position(-212.4, theory="spring", priors={"deformation_offset": zero})
    assert stated.gear.contact == -212.0
    assert not any("is a position" in note for note in stated.notes)
    # A test that begins under load, at a deformation that is counted from contact.
    loaded = {"deformation_mm": 30.0 + 0.5 * X, "force_N": 4.2 * (30.0 + 0.5 * X)}
    assert hdcal.read_case(loaded).gear.contact == 0.0
    # A force that falls with the position shows no place without force.
    falling = {"deformation_mm": X + 950.0, "force_N": np.ones(120) + NOISE - 1e-3 * X}
    assert hdcal.read_case(falling, range="all").gear.contact == 0.0


def test_the_cause_does_not_depend_on_the_origin():
    found = [hdcal.diagnose(position(origin), quick=True) for origin in ORIGINS]
    for each in found:
        assert each.which.effect == "load_friction"
        assert each.which.verdict in ("named", "group")
    shares = [each.which.on_mean[0].probability for each in found]
    np.testing.assert_allclose(shares, shares[0], atol=0.02)


@pytest.mark.parametrize("origin", ORIGINS[1:])
def test_a_capacity_is_judged_by_the_size_of_the_force(origin: float):
    """Below the origin a compressed spring is not in tension."""
    case = position(origin)
    posterior = hdcal.calibrate(case, effects=["load_friction"], warmup=300, draws=500)
    assert posterior.usable
    grid = default_bands(posterior).deformation_mm - origin
    assert grid.min() > -0.3 and grid.max() > 31.0
    up = hdcal.margin(posterior, origin + 15.0, limit_force=50.0)
    assert up.loading_sense == 1 and up.worst.capacity_N > 63.3
    assert up.worst.force_N.median == pytest.approx(4.2 * 15.0 * 1.0075, abs=0.1)
    down = hdcal.margin(posterior, origin + 15.0, direction="down")
    assert down.worst.force_N.median == pytest.approx(4.2 * 15.0 * 0.9925, abs=0.1)
    assert hdcal.predict(posterior, [origin + 30.0]).mean_N.median > 125.0
    for ask in (hdcal.margin, hdcal.predict):
        with pytest.raises(hdcal.InputError, match="far beyond"):
            ask(posterior, 15.0)
    with pytest.raises(hdcal.InputError, match="first contact"):
        hdcal.margin(posterior, origin + 15.0, quantity="load")


def test_a_fleet_of_positions_has_the_numbers_of_deformations():
    rng, tables = np.random.default_rng(5), []
    for gear in range(6):
        stiffness = 51.0 * (1.0 + 0.012 * rng.standard_normal())
        force = stiffness * TRAVEL + rng.normal(0.0, 1.0, 60)
        tables.append(np.column_stack([np.full(60, gear), TRAVEL, force]))
    gear, x, force = np.concatenate(tables).T
    found = []
    for origin in ORIGINS[:2]:
        table = {"specimen": gear, "deformation_mm": x + origin, "force_N": force}
        found.append(hdcal.fleet(table, deformation=origin + 12.0, draws=200))
    plain, position = found
    assert plain.next_force and position.next_force
    assert position.next_force.deformation_mm == pytest.approx(-200.4)
    ends = (plain.next_force.force_N.lo, plain.next_force.force_N.hi)
    theirs = (position.next_force.force_N.lo, position.next_force.force_N.hi)
    assert theirs == pytest.approx(ends, rel=0.02)
    gauges = [one.gauge_rr.percent_study_variation.median for one in found]
    assert gauges[1] == pytest.approx(gauges[0], rel=0.02)
    with pytest.raises(hdcal.InputError, match="deformation"):
        hdcal.fleet(table, deformation=12.0, draws=200)
