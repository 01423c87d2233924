"""The result of a fleet: what it says, its table, its files, and what it refuses."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal
from handmade_fleet import CHAINS, DRAWS, fitted, four_gears, handmade
from matplotlib.figure import Figure
from schema_checks import obeys

import hdcal
from hdcal.data.prior import Prior
from hdcal.errors import Finding, InputError
from hdcal.fleets.fleet import fleet_of
from hdcal.fleets.reading.readings import FleetReadings, fleet_readings
from hdcal.fleets.result import Fleet
from hdcal.inference.posterior import Posterior
from hdcal.quantities import TORQUE
from hdcal.report.table_files import columns_csv, frame_parquet


def with_case(**changes) -> FleetReadings:
    readings = four_gears()
    return replace(readings, case=replace(readings.case, **changes))


def of(readings: FleetReadings, odd=None, **asked) -> Fleet:
    return fleet_of(readings, fitted(readings, odd), **asked)


def test_the_odd_gear_is_named_first_and_in_the_table():
    fleet = handmade()
    assert fleet.headline.startswith("3 of 4 gears scatter by ")
    assert "D is 9.76 % softer (95 %: 9.48 … " in fleet.headline
    (one,) = fleet.flagged
    assert (one.gear, one.quantities) == ("D", {"stiffness": 0.99})
    assert one.apart_percent.lo < 100.0 * (180.0 / 199.5 - 1.0) < one.apart_percent.hi
    assert fleet.false_discovery_rate == pytest.approx(0.01)
    frame = fleet.to_frame()
    assert frame["gear"][frame["flagged"]].tolist() == ["D"]
    assert frame["flagged_in"].tolist() == ["", "", "", "stiffness"]
    assert frame["off_stiffness"].equals(frame["probability_off"])
    np.testing.assert_allclose(
        frame["stiffness_N_per_mm"] / frame["K"], 80.0, rtol=0.01
    )
    assert fleet.ranked(on_page=True)[0]["gear"] == "D"
    quiet = handmade(odd={})
    assert quiet.headline.endswith("none is flagged.") and not quiet.flagged
    assert quiet.false_discovery_rate is None and quiet.next_step is None
    table = quiet.gear_table.assign(probability_off=[0.1, 0.6, 0.2, 0.1])
    unsure = quiet.model_copy(update={"gear_table": table})
    assert "B most probably deviates (60 %)" in unsure.headline
    assert unsure.next_step and "B again" in unsure.next_step


def test_several_quantities_are_said_of_one_gear():
    odd = {"A": ["zero", "noise"], "B": ["noise"], "C": ["zero"], "D": ["stiffness"]}
    fleet = of(four_gears(), odd)
    assert [one.gear for one in fleet.flagged] == list("DABC")
    assert "A has its zero at " in fleet.headline and " and has " in fleet.headline
    assert fleet.headline.endswith("1 more is flagged.")
    assert "--specimen A" in str(fleet.next_step)
    assert fleet.headline.startswith("3 of 4 gears scatter by ")


@pytest.mark.parametrize(
    ("scale", "words"),
    [
        (1e-6, "D has < 1 % of the stiffness of the others"),
        (0.25, "D has 25 % of the stiffness of the others"),
        (8.0, "D is 8 times as stiff as the others"),
    ],
)
def test_a_broken_gear_is_described_in_plain_numbers(scale: float, words: str):
    readings = four_gears()
    fit = fitted(readings, {"D": ["stiffness"]})
    for name in ("apart_percent", "apart_lo", "apart_hi"):
        fit.gears.loc[3, name] = 100.0 * (scale - 1.0)
    fleet = fleet_of(readings, fit)
    assert words in fleet.headline and "itself of D" in str(fleet.next_step)


def test_names_are_written_as_a_shell_and_a_table_take_them():
    names = ("part 3", "0012", "=1+1", "Größe,\n7")
    out = {"X": Finding("data.csv", "a force is missing", "state it", 7)}
    readings = with_case(specimen_labels=names, left_out=out)
    fleet = of(readings, {"part 3": ["noise"]})
    assert "`--specimen 'part 3'`" in str(fleet.next_step)
    frame = fleet.to_frame()
    assert frame["gear"].tolist() == [*names, "X"]
    text = columns_csv(dict(frame))
    assert "'=1+1" in text and "false" in text
    parquet = pd.read_parquet(io.BytesIO(frame_parquet(frame) or b""))
    assert parquet["gear"].tolist() == [*names, "X"]
    assert parquet["stiffness_N_per_mm"].isna().tolist() == [False] * 4 + [True]


def test_lots_operators_and_rigs_are_in_the_answer():
    readings = with_case(
        lots=("low", "low", "high", "high"),
        operators=("K", "M", "K", "M"),
        rigs=("R", "R", "S", "S"),
    )
    fleet = of(readings, {"D": ["stiffness"]})
    assert [(one.name, one.members) for one in fleet.lots] == [("high", 2), ("low", 2)]
    assert [(one.name, one.members) for one in fleet.rigs] == [("R", 2), ("S", 2)]
    assert [one.name for one in fleet.operators] == ["K", "M"]
    assert "softer than its lot" in fleet.headline
    assert fleet.to_frame()["lot"].tolist() == ["low", "low", "high", "high"]
    sources = {source: force for source, _, _, force in fleet.scatter}
    # One percent of 0.5 mm of some 200 N/mm.
    assert len(sources) == 6 and sources["gears"] == pytest.approx(1.0, rel=0.02)
    assert len(fleet.notes) > len(handmade().notes)
    many = of(with_case(rigs=tuple("ABCD")))
    assert many.rigs == () and any("4 rigs" in note for note in many.notes)


def test_what_the_reader_must_know_is_in_the_notes():
    plain = set(handmade().notes)
    case = four_gears().case
    out = {"E": Finding("data.csv", "a force is missing", "state it", 7)}
    noted = replace(case, notes=("A column is ignored.",), left_out=out)
    fleet = of(replace(four_gears(), case=noted))
    added = set(fleet.notes) - plain
    assert len(added) == 2 and any("E" in note for note in added)
    assert fleet.left_out[0].gear == "E" and "a force is missing" in fleet.page()
    frame = fleet.to_frame()
    assert frame["status"][4] == "left out: data.csv, row 7: a force is missing"
    assert frame["stiffness_N_per_mm"].isna().tolist() == [False] * 4 + [True]
    priors = {**case.gear.priors, "force_gain": Prior("normal", (0.0, 0.002))}
    gear = replace(case.gear, priors=priors)
    certified = of(with_case(gear=gear))
    assert len(certified.lines("assumptions")) == 1 + len(fleet.lines("assumptions"))


def test_gears_of_several_sizes_keep_their_stiffness_in_the_table():
    ratio = np.array([1.0, 1.0, 1.0, 0.9])
    readings = four_gears().at_one_size(ratio)
    fleet = of(readings)
    assert fleet.at_one_size
    frame = fleet.to_frame()
    assert frame["size_ratio"].tolist() == ratio.tolist()
    read = [199.0, 200.0, 201.0, 180.0]
    np.testing.assert_allclose(frame["stiffness_N_per_mm"], read, atol=0.3)
    assert abs(frame["apart_percent"][3]) < 0.5


def test_the_result_keeps_its_schema_and_shows_itself():
    fleet = handmade(deformation=0.6, limit_force=85.0, force_tolerance=20.0)
    assert fleet.gauge_rr.deformation_mm == 0.6 and fleet.gauge_rr.percent_tolerance
    answer = json.loads(fleet.to_json())
    obeys(answer, Fleet)
    assert answer["schema"] == "hdcal.fleet/2" and answer["next_force"]["beyond_tested"]
    assert fleet.plot(Figure().add_subplot()).get_xlabel()
    assert {"gears", "curves"} <= fleet.charts().keys()
    (odd,) = (
        mark
        for mark in fleet.charts()["gears"].panels[0].marks
        if mark.label == "flagged"
    )
    np.testing.assert_array_equal(odd.y, fleet.to_frame()["stiffness_N_per_mm"][3:])
    assert "D" in fleet.text() and "<svg" not in fleet._repr_html_()


def test_a_failed_fleet_says_so_everywhere():
    fleet = handmade(failed="the largest R-hat is 1.2", deformation=0.4)
    assert fleet.status == "failed" and "1.2" in fleet.reasons[0]
    assert not fleet.flagged and fleet.next_force is None
    assert set(fleet.to_frame()["status"]) == {"failed"}
    obeys(json.loads(fleet.to_json()), Fleet)


def test_a_torsional_spring_is_named_after_torques():
    x = np.tile(np.linspace(0.0, 0.01, 5), 4)
    gear = np.repeat(list("ABCD"), 5)
    torque = 9000.0 * x + 0.05 * np.tile([1.0, -1.0, 0.0, -1.0, 1.0], 4)
    table = {"angle_rad": x, "torque_Nm": torque, "gear": gear}
    readings = fleet_readings(hdcal.read_case(table))
    fleet = of(readings, {"D": ["zero"]}, deformation=0.008, limit_force=80.0)
    answer = json.loads(fleet.to_json())
    jsonschema_of = Fleet.json_schema(TORQUE)
    assert "stiffness_N_m_per_rad" in answer["population"]
    assert answer["population"].keys() == (
        jsonschema_of["$defs"]["Population"]["properties"].keys()
    )
    assert "K" not in fleet.to_frame() and "zero_N_m" in fleet.to_frame()
    text = fleet.text()
    assert "N·m/rad" in text and " N " not in text and "force" not in text


def line(path: Path) -> Path:
    """Write the readings of gears that scatter, and return their file."""
    rng = np.random.default_rng(3)
    x = np.tile(np.linspace(0.02, 0.5, 10), 6)
    gear = np.repeat([f"G{i}" for i in range(6)], 10)
    force = np.repeat([199.0, 200.0, 201.0, 170.0, 200.5, 198.0], 10) * x
    table = {"gear": gear, "deformation_mm": x, "force_N": force}
    frame = pd.DataFrame(table)
    frame["force_N"] += rng.normal(0.0, 0.3, len(x))
    frame.to_csv(path, index=False)
    return path


def test_the_command_leaves_a_folder(hdcal: Hdcal, tmp_path: Path):
    line(tmp_path / "line.csv")
    asked = ("--deformation", 0.4, "--limit-force", 90, "--json")
    done = hdcal("fleet", "line.csv", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "line-fleet"
    names = {path.name for path in folder.iterdir()}
    assert {"gears.csv", "gears.parquet", "summary.json", "posterior.nc"} <= names
    assert {"report.html", "gears.png", "curves.svg"} <= names
    answer = json.loads((folder / "summary.json").read_text("utf-8"))
    obeys(answer, Fleet)
    assert json.loads(done.stdout) == answer
    assert [one["gear"] for one in answer["flagged"]] == ["G3"]
    table = pd.read_csv(folder / "gears.csv")
    assert table["gear"][table["flagged"]].tolist() == ["G3"]
    with pytest.raises(InputError, match="of a fleet"):
        Posterior.load(folder)


def test_the_tree_has_the_draws_of_the_population_and_of_gears_to_come():
    fleet = handmade()
    group = fleet.to_datatree()["posterior"]
    assert dict(group.sizes) == {"chain": CHAINS, "draw": DRAWS}
    # Draws of the first chain come first.
    second = fleet.draws["zero"][DRAWS:]
    np.testing.assert_array_equal(group["zero"].sel(chain=1), second)
    assert group["zero"].attrs["units"] == "N"
    predicted = fleet.to_datatree()["predictions"]["stiffness"]
    interval = fleet.next_gear.stiffness_N_per_mm
    assert np.quantile(predicted, 0.975) == pytest.approx(interval.hi)


@pytest.mark.parametrize(
    ("options", "refused"),
    [
        (("--deformation", 450), ["--deformation"]),
        (("--limit-force", 90), ["--limit-force"]),
        (("--force-tolerance", -1, "--seed", -1), ["--seed", "--force-tolerance"]),
        (("--scheduler", "tcp://x:1"), ["--scheduler"]),
        (("--gears", "none.csv"), ["none.csv"]),
    ],
)
def test_bad_input_is_refused_before_the_fit(here: Hdcal, options, refused):
    line(Path("line.csv"))
    done = here("fleet", "line.csv", *options)
    lines = done.stderr.splitlines()
    assert done.returncode == 2 and len(lines) == len(refused), done.stderr
    for each, name in zip(lines, refused, strict=True):
        assert each.startswith(f"hdcal: {name}: ")
    assert not Path("line-fleet").exists()


def test_the_gauge_is_that_of_the_deformation_asked_for():
    alone, asked = handmade(), handmade(deformation=0.2)
    assert alone.gauge_rr.deformation_mm == 0.5
    assert asked.gauge_rr.deformation_mm == 0.2
    gears = asked.gauge_rr.gears_N.median / alone.gauge_rr.gears_N.median
    assert gears == pytest.approx(0.4) and alone.gauge_rr.percent_tolerance is None
