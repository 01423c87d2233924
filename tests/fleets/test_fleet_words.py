"""What the words of a fleet say of rigs, units, certificates and what to do next."""

from dataclasses import replace

import numpy as np
import pytest
from fleets import handmade
from rigs import make_gear

from hdcal import fleet, read_case
from hdcal.data.prior import Prior
from hdcal.fleets.chart import fleet_chart
from hdcal.fleets.notes import CERTIFICATES
from hdcal.fleets.summary import fleet_answer, fleet_report
from hdcal.report.document import Table


def off_in(**kinds: list[bool]):
    """Return the fleet with other gears off."""
    found = handmade()
    told = {name: np.array(kinds.get(name, [False] * 4)) for name in found.off_in}
    return replace(found, off_in=told)


def with_gear(found, **changes):
    case = replace(found.case, gear=replace(found.case.gear, **changes))
    return replace(found, readings=replace(found.readings, case=case))


def test_a_gear_that_is_off_keeps_its_name_below_the_chart():
    found = off_in(stiffness=[True, False, False, False])
    chart = fleet_chart(found)
    assert [chart.names[place - 1] for place in chart.marked] == ["A"]


def test_gears_that_are_called_off_stand_first():
    document = fleet_report(off_in(noise=[True, False, False, False])).document
    (table,) = (
        block
        for section in document.sections
        for block in section.blocks
        if isinstance(block, Table) and block.columns[0] == "gear"
    )
    assert [row[0] for row in table.rows] == ["A", "D", "B", "C"]


def test_certificates_are_said_to_be_left_out():
    gain = Prior("normal", (0.0, 0.002))
    found = handmade()
    priors = {**found.case.gear.priors, "force_gain": gain}
    assert CERTIFICATES in fleet_answer(with_gear(found, priors=priors)).notes
    assert CERTIFICATES not in fleet_answer(found).notes
    assert "force_gain" not in make_gear().priors


def test_three_times_the_noise_is_said_to_be_three_times():
    rng, x = np.random.default_rng(3), np.linspace(0.05, 0.5, 60)
    noise = np.array([0.9, *[0.3] * 11])
    force = 200.0 * x + noise[:, None] * rng.standard_normal((12, 60))
    table = {"specimen": np.repeat([f"G{i}" for i in range(12)], 60)}
    table |= {"run": np.tile(np.repeat([0, 1], 30), 12)}
    table |= {"deformation_mm": np.tile(x, 12), "force_N": force.ravel()}
    found = fleet(read_case(table))
    assert found.off_in["noise"].tolist() == [True] + [False] * 11
    assert found.own_noise_sd == pytest.approx(noise, rel=0.3)


def test_the_gauge_is_told_where_a_force_is_asked_for():
    found = handmade()
    alone = fleet_answer(found).gauge_rr
    asked = fleet_answer(found, found.next_force(0.2)).gauge_rr
    assert (alone.deformation_mm, asked.deformation_mm) == (0.5, 0.2)
    assert asked.gears_N.median == pytest.approx(0.4 * alone.gears_N.median)
