"""Causes that gears share, and no cause where there is none."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal
from schema_checks import obeys

import hdcal
from hdcal.errors import Finding
from hdcal.evidence.noise_models import PRIOR_ODDS
from hdcal.evidence.search import search
from hdcal.fleets.reading.read_fleet import usable
from hdcal.physics.registry import EFFECTS
from hdcal.screening.channels import longest_stuck
from hdcal.shared_causes import gear_evidence
from hdcal.shared_causes.gear_evidence import Weight, by_cause, weigh_gear
from hdcal.shared_causes.gears import read_gears, usable_gears
from hdcal.shared_causes.result import FleetCauses

LIBRARY = {
    name: EFFECTS[name]
    for name in ("coulomb_friction", "large_deflection", "run_offset")
}
FRICTION = {"coulomb_friction": LIBRARY["coulomb_friction"]}
WITH_LOOP = ("G 1", "G2", "G3", "G4")
GEARS = (*WITH_LOOP, "G5", "G6", "G7")


def fleet(loop_N: float, seed: int = 0) -> pd.DataFrame:
    """Return gears that are loaded and unloaded on two mountings each."""
    rng, up = np.random.default_rng(seed), np.repeat([1.0, -1.0], [12, 11])
    x = np.r_[np.linspace(0.02, 0.48, 12), np.linspace(0.46, 0.04, 11)]
    parts = []
    for gear in GEARS:
        stiffness = 200.0 * (1.0 + 0.01 * rng.standard_normal())
        loop = loop_N * up * (gear in WITH_LOOP)
        for run in (1, 2):
            noise = rng.normal(0.0, 0.3, len(x)) + rng.normal(0.0, 2.0)
            force = np.round(stiffness * x + loop + noise, 4)
            rows = {"specimen": gear, "run": run, "deformation_mm": x, "force_N": force}
            parts.append(pd.DataFrame(rows))
    return pd.concat(parts, ignore_index=True)


def drifting(gears: int) -> pd.DataFrame:
    """Return eight gears, some read with an amplifier that drifts by 0.02 N/s."""
    rng = np.random.default_rng(4)
    x = np.tile(np.r_[np.linspace(0.02, 0.48, 12), np.linspace(0.46, 0.04, 11)], 2)
    time, parts = 50.0 * np.arange(len(x)), []
    for gear in range(8):
        stiffness = 200.0 * (1.0 + 0.01 * rng.standard_normal())
        force = stiffness * x + rng.normal(0.0, 0.3, len(x))
        force += 0.02 * time * (gear < gears)
        rows = {"specimen": f"G{gear}", "time_s": time, "deformation_mm": x}
        parts.append(pd.DataFrame(rows | {"force_N": np.round(force, 4)}))
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def with_loop():
    return hdcal.causes(fleet(0.8), library=LIBRARY)


@pytest.fixture(scope="module")
def one_gear():
    return usable_gears(read_gears(fleet(0.8)))[1]["G 1"]


def causes_of(found: FleetCauses) -> list[tuple[str, ...]]:
    return [tuple(each.causes.split(" / ")) for each in found.each_gear]


def shared(found: FleetCauses, name: str):
    return next(each for each in found.causes if each.cause == name)


def test_the_gears_with_an_effect_are_named(with_loop):
    assert not with_loop.reasons
    named = dict(zip(GEARS, causes_of(with_loop), strict=True))
    assert all(named[gear] == ("coulomb_friction",) for gear in WITH_LOOP)
    assert all("none" in named[gear] for gear in GEARS if gear not in WITH_LOOP)
    friction = shared(with_loop, "coulomb_friction")
    assert friction.gears_named == 4
    # Without the division of log odds by 1.6 the interval would end at 0.94.
    assert 0.15 < friction.share.lo < 4 / 7 < friction.share.hi < 0.99
    # Other gears make the cause of a gear more probable.
    for each in with_loop.each_gear[:4]:
        assert each.probability > each.probability_alone
    assert any(f"diagnose {gear} alone" in with_loop.next_step for gear in WITH_LOOP)
    obeys(with_loop.to_dict(), FleetCauses)
    assert "Coulomb friction" in with_loop.text()
    assert len(with_loop.common) >= 2


def test_offsets_of_runs_are_no_effect_of_a_gear():
    found = hdcal.causes(fleet(0.0), library=LIBRARY)
    assert causes_of(found) == [("none",)] * len(GEARS)
    assert all(each.cause != "run_offset" for each in found.causes)
    assert found.next_step is None


def test_offsets_of_runs_of_any_size_leave_the_evidence_unchanged(one_gear):
    force = one_gear.records.force + 5.0 * one_gear.records.run
    moved = replace(one_gear, records=replace(one_gear.records, force=force))
    one, other = (weigh_gear(each, FRICTION, 0) for each in (one_gear, moved))
    for cause in one:
        found = other[cause].log_evidence - other["none"].log_evidence
        expected = one[cause].log_evidence - one["none"].log_evidence
        assert found == pytest.approx(expected, abs=0.3)


def test_short_mountings_are_no_evidence():
    """A zero for every three readings leaves little of them, and no more than that."""
    rng, x = np.random.default_rng(10), np.linspace(0.05, 0.5, 3)
    parts = []
    for gear, run in np.ndindex(5, 10):
        noise = rng.normal(0.0, 0.3, 3) + rng.normal(0.0, 1.0)
        labels = {"specimen": f"G{gear}", "run": run, "deformation_mm": x}
        parts.append(pd.DataFrame({**labels, "force_N": 200.0 * x + noise}))
    found = hdcal.causes(pd.concat(parts), library=LIBRARY)
    assert all(each[0] == "none" for each in causes_of(found))
    assert shared(found, "outside").log_evidence_nat < 0.0


def test_evidence_is_the_mean_over_the_hypotheses(one_gear):
    library = {name: EFFECTS[name] for name in ("coulomb_friction", "outliers")}
    searched = search(one_gear, library, free_runs=True)
    table, found = searched.table, by_cause(searched, np.random.default_rng(0))
    noises = np.array([model.name for model in table.noises])

    def evidence(key, noise=""):
        return np.logaddexp.reduce(table.log_evidence[key][noises == noise])

    noisy = found["outliers"]
    assert np.exp(noisy.log_prior) == pytest.approx(0.5 * PRIOR_ODDS)
    expected = evidence((), "outliers") - np.log(PRIOR_ODDS)
    assert noisy.log_evidence == pytest.approx(expected)
    assert found["none"] == pytest.approx((evidence(()), np.log(0.5)))
    # Every joint evidence belongs to one cause, whatever the shares are.
    joint = [sum(each) for each in found.values()]
    whole = [row + table.log_prior(key) for key, row in table.log_evidence.items()]
    assert np.logaddexp.reduce(joint) == pytest.approx(np.logaddexp.reduce(whole, None))


@pytest.mark.thorough
def test_shared_work_gives_the_same_answer(with_loop):
    again = hdcal.causes(fleet(0.8), library=LIBRARY, jobs=2)
    assert causes_of(again) == causes_of(with_loop)
    for first, second in zip(again.causes, with_loop.causes, strict=True):
        assert first.cause == second.cause
        assert first.log_evidence_nat == pytest.approx(second.log_evidence_nat, 1e-6)


def weighed(gear, library, seed: int):
    """Return evidence as simulated gears have it, at once."""
    nats = 9.0 if gear.specimen_labels[0] in WITH_LOOP else -2.0
    friction = Weight(nats, np.log(0.2))
    return {"none": Weight(0.0, np.log(0.5)), "coulomb_friction": friction}


def spoiled(table: pd.DataFrame, how: str) -> pd.DataFrame:
    """Return the table with a fault in gear G5."""
    bad, force = table.specimen == "G5", table.force_N
    if how == "few rows":
        return table[~bad | (table.index % 12 == 0)]
    if how == "no scatter":
        return table.assign(force_N=force.where(~bad, 9 * table.deformation_mm))
    if how == "kN":
        force = force.where(~bad, force / 1000.0)
    if how == "opposite":
        force = force.where(~bad, -force)
    if how == "dead":
        force = force.where(~bad, 0.1)
    if how == "stuck":
        force[table.index[bad][15:23]] = force[table.index[bad][15]]
        force[table.index[bad][38:]] = force[table.index[bad][38]]
    if how == "drop":
        force[table.index[bad][9:23]] -= 30.0
    if how == "a word":
        force = force.astype(object)
        force[table.index[bad][3]] = "broken"
    return table.assign(force_N=force)


@pytest.mark.parametrize("gears", [1, 3])
def test_a_strong_effect_of_a_few_gears_is_evidence_and_no_fault(gears):
    readings = read_gears(drifting(gears))
    with pytest.raises(hdcal.InputError, match="do not follow a smooth curve"):
        usable(readings)
    _, found, left_out = usable_gears(readings)
    assert len(found) == 8 and not left_out
    library = {name: EFFECTS[name] for name in ("amplifier_drift", "coulomb_friction")}
    weight = weigh_gear(found["G0"], library, 0)
    assert not isinstance(weight, Finding)
    likeliest = max(weight, key=lambda cause: weight[cause].log_evidence)
    assert likeliest == "amplifier_drift"


@pytest.mark.parametrize("channel", ["force", "deformation"])
@pytest.mark.parametrize("rows", [slice(6, 11), slice(14, 23), slice(29, 37)])
def test_a_stuck_channel_is_named(channel, rows):
    table = fleet(0.8)
    name = {"force": "force_N", "deformation": "deformation_mm"}[channel]
    stuck = table.index[table.specimen == "G5"][rows]
    table.loc[stuck, name] = table.loc[stuck[0], name]
    with pytest.raises(hdcal.InputError, match=f"'G5'.*the {channel} is stuck"):
        usable_gears(read_gears(table))


def test_holds_and_coarse_displays_are_not_stuck():
    up = np.linspace(0.02, 0.5, 25)
    x, force = np.r_[up, np.full(20, 0.5)], 200.0 * np.r_[up, np.full(20, 0.5)]
    relaxed = force.copy()
    relaxed[25:] -= 30.0 * (1.0 - np.exp(-np.arange(20) / 12.0))
    crept = x.copy()
    crept[25:] += 0.1 * (1.0 - np.exp(-np.arange(20) / 12.0))
    one = np.zeros(45, int)
    assert longest_stuck(x, relaxed, one, display=False) == 0
    assert longest_stuck(force, crept, one, display=True) == 0
    fine, all_one = np.linspace(0.0, 0.5, 60), np.zeros(60, int)
    flat = np.minimum(200.0 * fine, 70.0)
    assert longest_stuck(np.round(flat, 0), fine, all_one, display=True) == 0
    assert longest_stuck(np.round(200.0 * fine, -1), fine, all_one, display=False) == 0
    # The next run may begin where the last one ended.
    runs = np.repeat(np.arange(9), 5)
    level = np.repeat([1.0, 2.0, 2.001], 15)
    assert longest_stuck(level, np.arange(45.0), one, display=True) == 15
    assert longest_stuck(np.arange(45.0), np.arange(45.0), runs, display=False) == 0


def failing(gear, library, seed: int):
    if gear.specimen_labels == ("G5",):
        return Finding(gear.name, "its evidence cannot be computed", "Leave it out")
    return weighed(gear, library, seed)


FAULTS = "few rows", "no scatter", "a word", "kN", "opposite", "dead", "stuck", "drop"


@pytest.mark.parametrize("how", [*FAULTS, "evidence"])
def test_a_bad_gear_is_named_and_left_out_when_asked(monkeypatch, how: str):
    weigh = failing if how == "evidence" else weighed
    monkeypatch.setattr("hdcal.shared_causes.causes.weigh_gear", weigh)
    table = spoiled(fleet(0.8), how)
    with pytest.raises(hdcal.InputError, match="'G5'"):
        hdcal.causes(table, library=FRICTION)
    found = hdcal.causes(table, library=FRICTION, skip_bad=True)
    assert tuple(found.to_frame().gear) == (*(g for g in GEARS if g != "G5"), "G5")
    assert [*found.left_out] == ["G5"] and found.gears == 6
    assert causes_of(found)[:4] == [("coulomb_friction",)] * 4
    assert "`--specimen 'G 1'`" in str(found.next_step)


@pytest.mark.parametrize(
    ("part", "result"),
    [("search", np.linalg.LinAlgError), ("by_cause", {"none": Weight(np.nan, 0.0)})],
)
def test_a_failed_evidence_is_a_finding(monkeypatch, one_gear, part, result):
    def broken(*_, **__):
        if isinstance(result, dict):
            return result
        raise result

    monkeypatch.setattr(gear_evidence, part, broken)
    found = weigh_gear(one_gear, FRICTION, 0)
    assert isinstance(found, Finding) and "'G 1'" in found.file


def test_the_command_answers_and_writes_its_table(here: Hdcal, tmp_path, monkeypatch):
    """Of a folder with a file for each gear."""
    monkeypatch.setattr("hdcal.shared_causes.causes.weigh_gear", weighed)
    (tmp_path / "line").mkdir()
    for gear, rows in fleet(0.8).groupby("specimen"):
        rows.drop(columns="specimen").to_csv(tmp_path / "line" / f"{gear}.csv")
    others = ",".join(name for name in EFFECTS if name not in LIBRARY)
    done = here("causes", "line", "--library", f"minus:{others}", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, FleetCauses)
    assert answer["causes"][0]["cause"] == "coulomb_friction"
    table = pd.read_csv(tmp_path / "line-causes" / "gears.csv")
    assert table.gear.to_list() == [*GEARS]
    assert table.causes.to_list()[:4] == ["coulomb_friction"] * 4


def test_bad_requests_are_one_finding_each(here: Hdcal, tmp_path):
    table = fleet(0.8)
    table[table.specimen == "G 1"].to_csv(tmp_path / "line.csv", index=False)
    done = here("causes", "line.csv", "--library", "all", "--jobs", 0)
    assert done.returncode == 2
    assert "at least 3" in done.stderr
    assert "--library" in done.stderr and "--jobs" in done.stderr
    assert not (tmp_path / "line-causes").exists()


@pytest.mark.thorough
def test_plain_noise_is_no_evidence_of_outliers():
    """Of thirty gears none has odds of twenty, which one in twenty may have."""
    x, found = np.linspace(0.02, 0.4, 20).round(3), []
    for seed in range(30):
        noise = np.random.default_rng(seed).normal(0.0, 0.3, 20)
        table = {"deformation_mm": x, "force_N": np.round(231.0 * x + noise, 2)}
        gear = hdcal.read_case(table | {"specimen": np.repeat("A", 20)})
        weight = weigh_gear(gear, {"outliers": EFFECTS["outliers"]}, 0)
        found.append(weight["outliers"].log_evidence - weight["none"].log_evidence)
    assert max(found) < np.log(20.0)
    assert np.mean(np.exp(found)) < 1.5
