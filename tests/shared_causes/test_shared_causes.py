"""Causes that gears share, and no cause where there is none."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal
from schema_checks import obeys

import hdcal
from hdcal.evidence.noise_models import PRIOR_ODDS
from hdcal.evidence.search import search
from hdcal.physics.registry import EFFECTS
from hdcal.shared_causes.gear_evidence import by_cause, gears_of, weigh_gear
from hdcal.shared_causes.result import FleetCauses

LIBRARY = {
    name: EFFECTS[name]
    for name in ("coulomb_friction", "large_deflection", "run_offset")
}
WITH_LOOP = ("G1", "G2", "G3", "G4")
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
            told = {"specimen": gear, "run": run, "deformation_mm": x, "force_N": force}
            parts.append(pd.DataFrame(told))
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def with_loop():
    return hdcal.causes(hdcal.read_case(fleet(0.8)), library=LIBRARY)


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
    assert 0.15 < friction.share.lo < 4 / 7 < friction.share.hi < 0.99
    # Other gears make the cause of a gear more probable.
    for each in with_loop.each_gear[:4]:
        assert each.probability > each.probability_alone
    assert with_loop.used[0].gear in WITH_LOOP
    obeys(with_loop.to_dict(), FleetCauses)


def test_every_way_to_show_it_names_what_it_found(with_loop):
    assert "4 have coulomb friction" in with_loop.headline
    assert with_loop.used[0].gear in with_loop.next_step
    for shown in (with_loop.text(), with_loop.page(), with_loop._repr_html_()):
        assert "coulomb friction" in shown
    bars, points = with_loop.charts()["causes"].panels[0].marks
    assert len(bars.at) == len(with_loop.common) >= 2
    assert np.all((bars.low <= points.y) & (points.y <= bars.high))


def test_offsets_of_runs_are_no_effect_of_a_gear():
    found = hdcal.causes(hdcal.read_case(fleet(0.0)), library=LIBRARY)
    assert causes_of(found) == [("none",)] * len(GEARS)
    assert all(each.cause != "run_offset" for each in found.causes)
    assert found.next_step is None


def test_offsets_of_runs_of_any_size_leave_the_evidence_unchanged():
    gear = gears_of(hdcal.read_case(fleet(0.8)))[0]
    force = np.asarray(gear.records.force) + 5.0 * np.asarray(gear.records.run)
    moved = replace(gear, records=replace(gear.records, force=force))
    library = {"coulomb_friction": LIBRARY["coulomb_friction"]}
    one, other = (weigh_gear(0, each, library, 0)[1] for each in (gear, moved))
    for cause in one:
        found = other[cause].log_evidence - other["none"].log_evidence
        expected = one[cause].log_evidence - one["none"].log_evidence
        assert found == pytest.approx(expected, abs=0.3)


@pytest.mark.parametrize(("runs", "rows"), [(6, 3), (10, 3)])
def test_short_mountings_are_no_evidence(runs: int, rows: int):
    """A zero for every three readings leaves little of them, and no more than that."""
    rng, x = np.random.default_rng(runs), np.linspace(0.05, 0.5, rows)
    parts = []
    for gear, run in np.ndindex(8, runs):
        noise = rng.normal(0.0, 0.3, rows) + rng.normal(0.0, 1.0)
        told = {"specimen": f"G{gear}", "run": run, "deformation_mm": x}
        parts.append(pd.DataFrame({**told, "force_N": 200.0 * x + noise}))
    found = hdcal.causes(pd.concat(parts), library=LIBRARY)
    assert all(each[0] == "none" for each in causes_of(found))
    assert shared(found, "outside").log_evidence_nat < 0.0


def test_evidence_is_the_mean_over_the_hypotheses():
    gear = gears_of(hdcal.read_case(fleet(0.8)))[0]
    library = {name: EFFECTS[name] for name in ("coulomb_friction", "outliers")}
    searched = search(gear, library, free_runs=True)
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


def assert_same(one: FleetCauses, other: FleetCauses) -> None:
    assert causes_of(one) == causes_of(other)
    for first, second in zip(one.causes, other.causes, strict=True):
        assert first.cause == second.cause
        assert first.log_evidence_nat == pytest.approx(second.log_evidence_nat, 1e-6)


@pytest.mark.thorough
def test_two_processes_say_the_same(with_loop):
    case = hdcal.read_case(fleet(0.8))
    again = hdcal.causes(case, library=LIBRARY, jobs=2)
    assert_same(again, with_loop)


@pytest.mark.thorough
def test_a_cluster_says_the_same(with_loop, local):
    case = hdcal.read_case(fleet(0.8))
    address = local.scheduler_address
    again = hdcal.causes(case, library=LIBRARY, scheduler=address)
    assert_same(again, with_loop)


def test_gears_that_say_too_little_are_named():
    table = fleet(0.8)
    few = table[(table.specimen != "G5") | (table.index % 12 == 0)]
    with pytest.raises(hdcal.InputError, match="'G5': has 4 rows in 2 runs, too few"):
        hdcal.causes(hdcal.read_case(few), library=LIBRARY)
    exact = table.assign(
        force_N=np.where(
            table.specimen == "G6", 200.0 * table.deformation_mm, table.force_N
        )
    )
    with pytest.raises(hdcal.InputError, match=r"gear 'G6'.*straight line"):
        hdcal.causes(hdcal.read_case(exact), library=LIBRARY)


def test_bad_gears_are_left_out_where_it_is_asked_for():
    table = fleet(0.8)
    table = table[(table.specimen != "G5") | (table.index % 12 == 0)]
    found = hdcal.causes(table, library=LIBRARY, skip_bad=True)
    used = tuple(g for g in GEARS if g != "G5")
    assert tuple(found.to_frame().gear) == (*used, "G5")
    assert [*found.left_out] == ["G5"] and found.gears == 6
    assert causes_of(found)[:4] == [("coulomb_friction",)] * 4


def test_the_command_answers_and_says_what_it_wrote(here: Hdcal, tmp_path):
    fleet(0.8).to_csv(tmp_path / "line.csv", index=False)
    others = ",".join(name for name in EFFECTS if name not in LIBRARY)
    done = here("causes", "line.csv", "--library", f"minus:{others}", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, FleetCauses)
    assert answer["causes"][0]["cause"] == "coulomb_friction"
    table = pd.read_csv(tmp_path / "line-causes" / "gears.csv")
    assert table.gear.to_list() == [*GEARS]
    assert table.causes.to_list()[:4] == ["coulomb_friction"] * 4


def test_what_cannot_be_asked_is_one_finding_each(here: Hdcal, tmp_path):
    table = fleet(0.8)
    table[table.specimen == "G1"].to_csv(tmp_path / "line.csv", index=False)
    done = here("causes", "line.csv", "--library", "all", "--jobs", 0)
    assert done.returncode == 2
    assert "takes 3 or more" in done.stderr
    assert "--library" in done.stderr and "--jobs" in done.stderr
    assert not (tmp_path / "line-causes").exists()


def test_plain_noise_is_no_evidence_of_outliers():
    """Of thirty gears none has odds of twenty, which one in twenty may have."""
    x, found = np.linspace(0.02, 0.4, 20).round(3), []
    for seed in range(30):
        noise = np.random.default_rng(seed).normal(0.0, 0.3, 20)
        table = {"deformation_mm": x, "force_N": np.round(231.0 * x + noise, 2)}
        gear = hdcal.read_case(table | {"specimen": np.repeat("A", 20)})
        weight = weigh_gear(0, gear, {"outliers": EFFECTS["outliers"]}, 0)[1]
        found.append(weight["outliers"].log_evidence - weight["none"].log_evidence)
    assert max(found) < np.log(20.0)
    assert np.mean(np.exp(found)) < 1.5
