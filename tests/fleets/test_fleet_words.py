"""What the words of a fleet say of rigs, units, certificates and what to do next."""

from dataclasses import replace

import numpy as np
import pytest
from fleets import handmade
from rigs import make_gear

from hdcal import fleet, read_case
from hdcal.data.prior import Prior
from hdcal.fleets.chart import fleet_chart
from hdcal.fleets.force.document import force_words
from hdcal.fleets.notes import CERTIFICATES
from hdcal.fleets.over_time import TimeAnswer
from hdcal.fleets.summary import fleet_answer, fleet_report
from hdcal.fleets.time_words import time_words
from hdcal.report.document import Table
from hdcal.report.intervals import Interval


def off_in(**kinds: list[bool]):
    """Return the fleet with other gears off."""
    found = handmade()
    told = {name: np.array(kinds.get(name, [False] * 4)) for name in found.off_in}
    return replace(found, off_in=told)


def with_gear(found, **changes):
    case = replace(found.case, gear=replace(found.case.gear, **changes))
    return replace(found, readings=replace(found.readings, case=case))


def test_a_gear_that_is_soft_is_measured_again_and_one_with_a_loop_diagnosed():
    soft = fleet_answer(off_in(stiffness=[False, False, False, True])).next_step
    again = "Mount D anew and measure again before you act on this."
    assert soft == again
    both = {"stiffness": [False, False, False, True], "shape": [True] + [False] * 3}
    said = str(fleet_answer(off_in(**both)).next_step)
    assert said.startswith("See what A has by itself") and "`--specimen A`" in said
    assert again in said
    many = {"stiffness": [False, True, True, True]}
    assert " and 2 more anew" in str(fleet_answer(off_in(**many)).next_step)


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


@pytest.mark.parametrize(("times", "way"), [(25.4, "stiffer"), (1 / 25.4, "softer")])
def test_gears_far_from_their_theory_are_spoken_of(times: float, way: str):
    found = with_gear(handmade(), theory="ring")
    draws = found.draws | {"stiffness": found.draws["stiffness"] * times}
    words = f"times {way} than their theory"
    said = fleet_answer(replace(found, draws=draws)).notes
    assert any(words in note and "units" in note for note in said)
    assert not any("than their theory" in note for note in fleet_answer(found).notes)


def test_certificates_are_said_to_be_left_out():
    gain = Prior("normal", (0.0, 0.002))
    found = handmade()
    priors = {**found.case.gear.priors, "force_gain": gain}
    assert CERTIFICATES in fleet_answer(with_gear(found, priors=priors)).notes
    assert CERTIFICATES not in fleet_answer(found).notes
    assert "force_gain" not in make_gear().priors


def test_a_change_that_is_likely_but_not_sure_is_no_change_and_no_lack_of_one():
    about = {"what": "zero", "changed": False}
    blank = {name: None for name in TimeAnswer.__dataclass_fields__} | about
    for sure, words in ((0.76, "not sure (76 %"), (0.2, "no change is told")):
        answer = TimeAnswer(**blank | {"probability_changed": sure})
        assert words in time_words(answer)


def test_the_noise_of_a_gear_that_is_off_in_it_is_its_own():
    """The law of all, whose scatter is small, draws it in."""
    found = off_in(noise=[True, False, False, False])
    own = np.array([1.5, 0.5, 0.5, 0.5])
    said = fleet_answer(replace(found, own_noise_sd=own)).headline
    assert "A has 3 times the noise of most (1.5 N)" in said


def test_three_times_the_noise_is_said_to_be_three_times():
    rng, x = np.random.default_rng(3), np.linspace(0.05, 0.5, 60)
    noise = np.array([0.9, *[0.3] * 11])
    force = 200.0 * x + noise[:, None] * rng.standard_normal((12, 60))
    table = {"specimen": np.repeat([f"G{i}" for i in range(12)], 60)}
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


@pytest.mark.parametrize(
    ("share", "said"),
    [(0.24, "24 %"), (0.0019, "0.2 %"), (3e-4, "0.03 %"), (1e-7, "< 0.01 %")],
)
def test_a_small_share_of_gears_is_said_as_one(share: float, said: str):
    force = handmade().next_force(0.4, 90.0)
    told = replace(force, probability_exceeded=Interval(share, 0.0, 1.0))
    assert next(force_words(told)).startswith(f"{said} of gears to come need more")
