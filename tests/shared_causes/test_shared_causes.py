"""What gears have in common is found, and nothing where there is nothing."""

import json

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal
from schema_checks import obeys

import hdcal
from hdcal.diagnosis.model_posterior import carried, log_priors
from hdcal.diagnosis.weighing import weigh
from hdcal.physics.registry import EFFECTS
from hdcal.report.plain import as_plain
from hdcal.shared_causes.answer import CausesAnswer
from hdcal.shared_causes.gear_evidence import gears_of, weigh_gear
from hdcal.shared_causes.summary import cause_columns, causes_answer

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


def test_the_gears_with_an_effect_are_told(with_loop):
    assert not with_loop.reasons
    told = dict(zip(GEARS, with_loop.of_gears, strict=True))
    assert all(told[gear] == ("coulomb_friction",) for gear in WITH_LOOP)
    assert all("none" in told[gear] for gear in GEARS if gear not in WITH_LOOP)
    place = with_loop.causes.index("coulomb_friction")
    low, high = np.quantile(with_loop.share[:, place], [0.025, 0.975])
    assert low < 4 / 7 < high and low > 0.15 and high < 0.95
    # Gears say of each other what one alone does not.
    chance = with_loop.chance[:4, place]
    assert np.all(chance > with_loop.alone[:4, place])
    answer = causes_answer(with_loop)
    obeys(as_plain(answer), CausesAnswer)


def test_zeros_of_mountings_are_no_effect_of_a_gear():
    found = hdcal.causes(hdcal.read_case(fleet(0.0)), library=LIBRARY)
    assert found.of_gears == [("none",)] * len(GEARS)
    assert "run_offset" not in found.causes
    assert causes_answer(found).next_step is None


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
    assert all(own[0] == "none" for own in found.of_gears)
    place = found.causes.index("unknown")
    assert found.log_evidence[:, place].sum() < 0.0


def test_evidence_is_that_of_the_hypotheses():
    """With hypotheses that a cause leads in, weighted as they are before the data."""
    case = hdcal.read_case(fleet(0.8))
    gear = gears_of(case)[0]
    library = {"coulomb_friction": LIBRARY["coulomb_friction"]}
    evidence = weigh(gear, library, np.random.default_rng(0)).evidence
    table = {name: np.logaddexp.reduce(v) for name, v in evidence.table.items()}
    names = list(table)
    prior = dict(zip(names, np.exp(log_priors(names)), strict=True))
    beside = "coulomb_friction+unknown"
    carries = np.clip(carried(evidence)["coulomb_friction"], 1e-3, 1.0 - 1e-3)
    alone, half = prior["coulomb_friction"], 0.5 * prior[beside]
    parts = (
        alone * np.exp(table["coulomb_friction"] - table["none"]),
        half * np.exp(table[beside] - table["none"]) * 2.0 * carries,
    )
    told = weigh_gear(0, gear, library, 0)[1]
    over = told["coulomb_friction"].log_evidence - told["none"].log_evidence
    assert over == pytest.approx(np.log(sum(parts) / (alone + half)))
    assert np.exp(told["coulomb_friction"].log_prior) == pytest.approx(alone + half)


@pytest.mark.thorough
def test_two_processes_say_the_same(with_loop):
    case = hdcal.read_case(fleet(0.8))
    again = hdcal.causes(case, library=LIBRARY, jobs=2)
    for name in ("alone", "log_evidence"):
        one, other = getattr(again, name), getattr(with_loop, name)
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9, err_msg=name)
    assert again.of_gears == with_loop.of_gears


@pytest.mark.thorough
def test_a_cluster_says_the_same(with_loop, local):
    case = hdcal.read_case(fleet(0.8))
    address = local.scheduler_address
    again = hdcal.causes(case, library=LIBRARY, scheduler=address)
    for name in ("alone", "log_evidence"):
        one, other = getattr(again, name), getattr(with_loop, name)
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9, err_msg=name)


def test_gears_that_say_too_little_are_named():
    table = fleet(0.8)
    few = table[(table.specimen != "G5") | (table.index % 12 == 0)]
    with pytest.raises(hdcal.InputError, match="'G5': has 4 rows in 2 runs, too few"):
        hdcal.causes(hdcal.read_case(few), library=LIBRARY)
    exact = table.assign(
        force_N=np.where(
            table.specimen == "G6", 9 * table.deformation_mm, table.force_N
        )
    )
    with pytest.raises(hdcal.InputError, match=r"gear 'G6'.*straight line"):
        hdcal.causes(hdcal.read_case(exact), library=LIBRARY)


def test_bad_gears_are_left_out_where_it_is_asked_for():
    table = fleet(0.8)
    table = table[(table.specimen != "G5") | (table.index % 12 == 0)]
    found = hdcal.causes(table, library=LIBRARY, skip_bad=True)
    assert found.case.specimen_labels == tuple(g for g in GEARS if g != "G5")
    assert found.of_gears[:4] == [("coulomb_friction",)] * 4


def test_the_command_answers_and_says_what_it_wrote(here: Hdcal, tmp_path):
    fleet(0.8).to_csv(tmp_path / "line.csv", index=False)
    others = ",".join(name for name in EFFECTS if name not in LIBRARY)
    done = here("causes", "line.csv", "--library", f"minus:{others}", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, CausesAnswer)
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


def test_a_row_for_each_gear(with_loop):
    columns = cause_columns(with_loop)
    assert {len(column) for column in columns.values()} == {len(GEARS)}
    assert np.all(columns["probability"] >= columns["probability_none"] - 1e-12)


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
