"""A rig that reads too much is told from its gears, and makes none of them off."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from fleets import handmade

import hdcal
from hdcal.fleets.fleet_posterior import FleetPosterior
from hdcal.fleets.gear_sums import gear_sums
from hdcal.fleets.groupings import group_offsets
from hdcal.fleets.groups import linked_rigs, rig_grouping
from hdcal.fleets.next_gear import new_group_sd
from hdcal.fleets.notes import RIGS_APART
from hdcal.fleets.over_time import time_answer, time_series
from hdcal.fleets.read_fleet import read_fleet
from hdcal.fleets.summary import fleet_answer, gear_columns

X, NOISE, MOUNTED = np.linspace(0.05, 0.5, 8), 0.3, 0.4


def measured(read, gains, *, gear_sd=0.004, seed=0) -> pd.DataFrame:
    """Return readings of gears of 200 N/mm.

    Args:
        read: rigs that read each gear, once per name.
        gains: share by which each rig reads too much.
        gear_sd: by which gears differ.
        seed: of the draws.
    """
    rng, parts = np.random.default_rng(seed), []
    for gear, rigs in enumerate(read):
        stiffness = 200.0 * (1.0 + gear_sd * rng.standard_normal())
        for run, rig in enumerate(rigs):
            about = {"specimen": f"G{gear}", "rig": rig, "run": run}
            zero = MOUNTED * rng.standard_normal()
            force = stiffness * (1.0 + gains[rig]) * X + zero
            force += NOISE * rng.standard_normal(len(X))
            days = {"date": f"2026-03-{'ABC'.index(rig) + 1:02d}"}
            about |= days | {"operator": "KM"[(gear + run) % 2]}
            parts.append(pd.DataFrame(about | {"deformation_mm": X, "force_N": force}))
    return pd.concat(parts, ignore_index=True)


def fitted(table: pd.DataFrame, *without: str):
    case = hdcal.read_case(table.drop(columns=[*without]), theory="spring")
    found = hdcal.fleet(case)
    assert not found.reasons and found.settings["sampler"] == "importance sampling"
    return found


def gains_of(found) -> np.ndarray:
    """Return low end, middle and high end of each gain."""
    drawn = np.asarray(group_offsets(found.draws, "rig"))
    return np.quantile(drawn, [0.005, 0.5, 0.995], axis=1)


# A alone read most gears, B some of them too, and one that A never had.
GAINS = {"A": 0.02, "B": -0.02}
SOME = ["A"] * 11 + ["AB"] * 2 + ["B"]


@pytest.fixture(scope="module")
def told():
    return fitted(measured(SOME, GAINS), "operator")


@pytest.fixture(scope="module")
def untold():
    return fitted(measured(SOME, GAINS), "operator", "rig")


def test_gains_are_found(told):
    assert told.rigs == ["A", "B"]
    low, middle, high = gains_of(told)
    assert np.all((low < [0.02, -0.02]) & (high > [0.02, -0.02]))
    assert middle == pytest.approx([0.02, -0.02], abs=0.003)
    assert np.all(np.abs(np.median(told.stiffness, axis=0) / 200.0 - 1.0) < 0.015)


def test_gears_neither_scatter_nor_are_off_by_their_rig(told, untold):
    assert not told.called.any() and not any(vars(told.misfit).values())
    assert np.median(told.draws["specimen_sd"]) < 0.006
    # Where nobody says which rig it was.
    assert untold.off_in["stiffness"][-1]
    assert np.all(untold.noise_sd[11:13] > 1.5 * np.median(told.noise_sd))
    assert untold.rigs == [] and "rig_sd" not in untold.draws


def test_a_rig_that_comes_later_changes_no_zero_and_no_gear(told, untold):
    changed = {one.what: time_answer(one).changed for one in time_series(told)}
    assert changed == {"stiffness": False, "zero": False, "noise": False}
    assert any(time_answer(one).changed for one in time_series(untold))


def test_answer_page_and_file_name_the_rigs(told, tmp_path):
    answer = fleet_answer(told)
    assert [(one.rig, one.mountings) for one in answer.rigs] == [("A", 13), ("B", 3)]
    assert answer.rigs[0].gain_apart_percent.median == pytest.approx(2.0, abs=0.3)
    assert answer.population.rig_sd_percent is not None
    assert RIGS_APART not in answer.notes
    told.posterior.save(tmp_path / "posterior.nc")
    again = FleetPosterior.load(tmp_path)
    assert again.facts.rigs == ("A", "B")
    assert again.tree["posterior"]["rig_2"].attrs["long_name"] == "B"
    assert again.next_force(0.4) == told.next_force(0.4)


def test_a_rig_to_come_widens_its_readings_and_no_gear(told):
    without = {name: v for name, v in told.draws.items() if not name.startswith("rig_")}
    wide = told.next_force(0.4).force_N
    narrow = hdcal.fleets.next_force.next_force(without, 0.4).force_N
    by_rig = 80.0 * np.median(new_group_sd(told.draws, "rig"))
    assert wide.hi - wide.lo > narrow.hi - narrow.lo + by_rig
    sd = np.std(told.next_stiffness) / 200.0
    assert sd < 0.5 * np.median(told.draws["rig_sd"])


@pytest.mark.thorough
def test_three_rigs_and_operators_are_told_together():
    gains = {"A": 0.03, "B": -0.01, "C": -0.02}
    found = fitted(measured(["ABC"] * 10, gains), "date")
    assert (found.rigs, found.operators) == (["A", "B", "C"], ["K", "M"])
    low, _, high = gains_of(found)
    assert np.all((low < [*gains.values()]) & (high > [*gains.values()]))
    assert not found.called.any() and "operator_1" in found.draws
    assert "rig" not in gear_columns(found)


@pytest.mark.thorough
def test_of_gears_with_a_rig_each_the_reader_knows_what_is_assumed():
    """Only that gears are alike tells gains: as well as means of gears are known."""
    found = fitted(
        measured(["AA", "BB"] * 8, GAINS, gear_sd=0.01, seed=1), "operator", "date"
    )
    low, _, high = gains_of(found)
    assert np.all((low < [0.02, -0.02]) & (high > [0.02, -0.02]))
    notes = fleet_answer(found).notes
    assert RIGS_APART in notes
    # Eight gears of 1 % each: half the difference of two means.
    sd = np.std(found.draws["rig_1"])
    assert sd == pytest.approx(0.01 / np.sqrt(16.0), rel=0.5)
    assert not found.called.any()


@pytest.mark.parametrize(
    ("read", "links"),
    [
        (["AB", "B", "A"], [0, 0]),
        (["AB", "BC"], [0, 0, 0]),
        (["AB", "CC"], [0, 0, 1]),
        (["AA", "B"], [0, 1]),
    ],
)
def test_gears_link_rigs(read, links):
    readings = read_fleet(measured(read, dict.fromkeys("ABC", 0.0)))
    found = linked_rigs(readings.sums)
    assert np.array_equal(found[:, None] == found, np.equal.outer(links, links))


@pytest.mark.parametrize("read", [["AB"] * 12, ["A", "B"] * 15, ["AB", "BC"] * 6])
def test_where_rigs_seem_to_be_is_near(read):
    """A gear that is off, in half of the fleets, moves them little."""
    gains = {"A": 0.02, "B": -0.01, "C": -0.01}
    for seed in range(20):
        table = measured(read, gains, gear_sd=0.01, seed=seed)
        table.loc[table["specimen"] == "G0", "force_N"] *= 0.9 + 0.1 * (seed % 2)
        sums = read_fleet(table).sums
        seen = rig_grouping(sums, NOISE)
        truth = np.array([*gains.values()])[: len(seen.basis)]
        apart = seen.estimate - seen.basis.T @ truth
        assert np.all(np.abs(apart) < 4.5 * np.sqrt(seen.variance))
        assert np.all(np.sqrt(seen.variance) < 0.006)


def test_noise_is_beside_a_line_on_each_rig():
    """The same readings, of which one rig has seen half: numpy's own lines."""
    sums = read_fleet(measured(["AB", "AA", "BBA"], {"A": 0.1, "B": -0.1})).sums
    found = gear_sums(sums, np.zeros(3, int))
    for gear, rigs in enumerate([2, 1, 2]):
        here = np.flatnonzero(sums.gear == gear)
        square = 0.0
        for rig in np.unique(sums.rig[here]):
            own = here[sums.rig[here] == rig]
            xx, xy, yy = (getattr(sums, n)[own].sum() for n in ("xx", "xy", "yy"))
            square += yy - xy**2 / xx
        free = len(here) * (len(X) - 1) - rigs
        assert found.noise_free[gear] == free
        sd = np.sqrt(square / free)
        assert np.exp(found.log_noise_sd[gear]) == pytest.approx(sd)
        assert sd == pytest.approx(NOISE, rel=0.6)


def test_rigs_that_are_left_out_are_none():
    table = measured(["ABC", "AB", "BC", "BC"], dict.fromkeys("ABC", 0.0))
    table["specimen"] = table["specimen"].replace({"G0": "X"})
    readings = read_fleet(table)
    since = readings.since("2026-03-02")
    assert since.case.rigs == ("B", "C", "B", "B", "C", "B", "C")
    assert since.sums.rig.tolist() == [0, 1, 0, 0, 1, 0, 1]
    bad = table.astype({"force_N": object})
    bad.loc[(bad["specimen"] == "G1") & (bad["rig"] == "A"), "force_N"] = "none"
    left = read_fleet(bad, skip_bad=True)
    assert left.case.rigs == ("A", "B", "C", "B", "C", "B", "C")
    assert left.sums.rig.tolist() == [0, 1, 2, 1, 2, 1, 2]


def test_many_rigs_are_taken_for_one():
    sums = read_fleet(measured(["A", "B", "C"], dict.fromkeys("ABC", 0.0))).sums
    assert not sums.rig.any()
    found = handmade()
    case = replace(found.case, rigs=tuple("ABCD"))
    many = replace(found, readings=replace(found.readings, case=case))
    assert any("4 rigs are too many" in note for note in fleet_answer(many).notes)


def test_a_single_reading_on_a_rig_takes_no_slope():
    frame = measured(["A", "A", "A"], {"A": 0.0})
    once = frame.iloc[[0]].assign(run="once", rig="B")
    sums = read_fleet(pd.concat([frame, once], ignore_index=True)).sums
    alone = gear_sums(read_fleet(frame).sums, np.zeros(3, int))
    found = gear_sums(sums, np.zeros(3, int))
    np.testing.assert_array_equal(found.noise_free, alone.noise_free)
    np.testing.assert_allclose(found.log_noise_sd, alone.log_noise_sd)
