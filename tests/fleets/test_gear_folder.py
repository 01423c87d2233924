"""A folder with a file, or a folder, for each gear is one fleet."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commands import Hdcal

import hdcal as api
from hdcal.data.measurements.gear_files import gear_files
from hdcal.data.reading import read_case
from hdcal.errors import InputError
from hdcal.fleets.left_out import left_out_of
from hdcal.fleets.read_fleet import read_fleet
from hdcal.fleets.usable import usable

GEARS, WALL = 6, 0.68
SIZES = {"wall_thickness_mm": WALL, "radius_mm": 40.0, "length_mm": 70.0}


def measured() -> pd.DataFrame:
    """Return readings of gears G0, G1, …, each with another wall, in two runs."""
    rng = np.random.default_rng(4)
    x = np.linspace(0.05, 0.5, 10)
    parts = [
        pd.DataFrame(
            {
                "specimen": f"G{gear}",
                "lot": "AB"[gear % 2],
                "operator": "KM"[run],
                "rig": "12"[run],
                "date": f"2026-04-{gear + 1:02d}",
                "run": run,
                "deformation_mm": x,
                "force_N": 90.0 * (wall / WALL) ** 3 * x + rng.normal(0.0, 0.2, len(x)),
                "temperature_C": 20.0 + gear,
            }
        )
        for gear, wall in enumerate(walls())
        for run in range(2)
    ]
    return pd.concat(parts, ignore_index=True).round(6)


def walls() -> np.ndarray:
    return WALL * np.linspace(1.0, 1.2, GEARS)


def write_gear(path: Path, text: str = "", **sizes: float) -> None:
    lines = [f"{name} = {value!r}" for name, value in (SIZES | sizes).items()]
    path.write_text("\n".join(["[gear]", *lines, text]), "utf-8")


def as_files(folder: Path) -> Path:
    """Write a file for each gear, which does not name it, and one gear file."""
    folder.mkdir()
    for gear, part in measured().groupby("specimen"):
        part.drop(columns="specimen").to_csv(folder / f"{gear}.csv", index=False)
    write_gear(folder / "gear.toml")
    return folder


def as_cases(folder: Path) -> Path:
    """Write a folder for each gear, with its own gear file."""
    for (gear, part), wall in zip(
        measured().groupby("specimen"), walls().tolist(), strict=True
    ):
        own = folder / str(gear)
        own.mkdir(parents=True)
        part.drop(columns="specimen").to_csv(own / "data.csv", index=False)
        write_gear(own / "gear.toml", wall_thickness_mm=wall)
    return folder


def told(make, *args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        make(*args, **kwargs)
    return [str(finding) for finding in caught.value.findings]


def same(found, frame: pd.DataFrame) -> None:
    """Check that readings are those of one table that names its gears."""
    whole = read_fleet(frame, SIZES)
    for name in ("specimen_labels", "run_labels", "lots", "operators", "rigs", "dates"):
        assert getattr(found.case, name) == getattr(whole.case, name), name
    for name, column in vars(found.sums).items():
        assert np.array_equal(column, getattr(whole.sums, name)), name


def test_files_are_gears_called_as_they_are(tmp_path):
    found = read_fleet(as_files(tmp_path / "line"))
    same(found, measured())
    assert found.case.name == "line" and found.sizes is None
    assert any("each file is a gear" in note for note in found.case.notes)


def test_a_file_that_names_gears_is_believed(tmp_path):
    folder, frame = as_files(tmp_path / "line"), measured()
    two = frame["specimen"].isin(["G0", "G1"])
    for name in ("G0", "G1"):
        (folder / f"{name}.csv").unlink()
    # Half of the runs in each of two files, as of two shifts.
    for shift in range(2):
        part = frame.loc[two & (frame["run"] == shift)].drop(columns="run")
        part.to_csv(folder / f"F{shift}.csv", index=False)
    found = read_fleet(folder)
    labels = found.case.specimen_labels
    assert labels == ("G0", "G1", "G2", "G3", "G4", "G5")
    assert np.bincount(found.sums.gear).tolist() == [2] * GEARS
    whole = read_fleet(frame, SIZES)
    of_both = [np.bincount(each.sums.gear, each.sums.xy) for each in (found, whole)]
    assert of_both[0] == pytest.approx(of_both[1])


def test_a_gear_that_is_bad_in_one_file_is_left_out_of_all(tmp_path):
    frame = measured()
    for run, part in frame.astype({"force_N": object}).groupby("run"):
        part = part.drop(columns="run").reset_index(drop=True)
        part.loc[2, "force_N"] = "abc" if run else part.loc[2, "force_N"]
        part.to_csv(tmp_path / f"F{run}.csv", index=False)
    found = read_fleet(tmp_path, SIZES, skip_bad=True)
    assert found.case.specimen_labels == ("G1", "G2", "G3", "G4", "G5")
    assert set(found.case.left_out) == {"G0"}
    # Of a file that says nothing nobody knows which gears it held.
    (tmp_path / "F2.csv").write_text("nothing\n")
    words = told(read_fleet, tmp_path, SIZES, skip_bad=True)
    assert words and all("F2.csv" in one for one in words)


def test_folders_bring_the_sizes_of_each_gear(tmp_path):
    found = read_fleet(as_cases(tmp_path / "line"))
    same(found, measured())
    _, ratio = usable(found)
    assert ratio == pytest.approx((walls() / WALL) ** 3)
    assert any("G0/gear.toml" in note for note in found.case.notes)
    # Another gear may be the one at whose sizes they are compared.
    other = tmp_path / "line" / "G3" / "gear.toml"
    again = read_fleet(tmp_path / "line", other)
    assert usable(again)[1] == pytest.approx((walls() / walls()[3]) ** 3)
    assert any("G3/gear.toml" in note for note in again.case.notes)
    table = {"specimen": ["G0"], "length_mm": [70.0]}
    assert any("gears: " in one for one in told(usable, found, table))


def test_gear_files_differ_in_sizes_only(tmp_path):
    folder = as_cases(tmp_path / "line")
    write_gear(folder / "G2" / "gear.toml", 'theory = "cup"')
    prior = '[priors]\nE0 = { family = "normal", mean = 2e5, sd = 1e3, unit = "MPa" }'
    write_gear(folder / "G4" / "gear.toml", prior)
    words = told(read_fleet, folder)
    assert any("G2/gear.toml, column 'gear.theory': is cup" in one for one in words)
    assert any("G4/gear.toml, column 'priors.E0.mean'" in one for one in words)
    found = read_fleet(folder, skip_bad=True)
    assert set(found.case.left_out) == {"G2", "G4"}


def test_what_is_wrong_with_all_files_is_told_at_once(tmp_path):
    folder = as_files(tmp_path / "line")
    for name, change in (("G1", "abc"), ("G4", "def")):
        lines = (folder / f"{name}.csv").read_text().splitlines()
        cells = lines[3].split(",")
        cells[5] = change
        (folder / f"{name}.csv").write_text(
            "\n".join([*lines[:3], ",".join(cells), *lines[4:]])
        )
    (folder / "G5.csv").write_text("")
    words = told(api.fleet, folder)
    for name, problem in (("G1", "'abc'"), ("G4", "'def'"), ("G5", "empty")):
        assert any(f"{name}.csv" in one and problem in one for one in words)
    assert words[-1].startswith("skip_bad: 3 of 6 gears are bad: 'G1', 'G4', 'G5'")
    found = read_fleet(folder, skip_bad=True)
    same(found, measured().query("specimen not in ['G1', 'G4', 'G5']"))
    assert found.case.left_out["G1"].row == 4


def test_why_a_gear_is_left_out_names_its_file(tmp_path):
    folder = as_files(tmp_path / "line")
    still = pd.read_csv(folder / "G2.csv").assign(deformation_mm=0.3)
    still.to_csv(folder / "G2.csv", index=False)
    (folder / "G4.csv").write_text("")
    left_out = left_out_of(read_fleet(folder, skip_bad=True).case)
    why = {one.gear: one.why for one in left_out}
    column = f"{folder / 'G2.csv'}, column 'deformation_mm'"
    assert why["G2"].startswith(f"{column}: the deformation is constant")
    assert why["G4"].startswith(str(folder / "G4.csv")) and "empty" in why["G4"]
    for gear in ("G0", "G1"):
        (folder / f"{gear}.csv").unlink()
    words = told(api.fleet, folder, skip_bad=True)
    assert any(f"gear 'G2' {column}: the deformation is" in one for one in words)


def test_files_may_have_columns_of_their_own(tmp_path):
    """Other names, other units and no temperature, which is then the reference's."""
    folder, frame = as_files(tmp_path / "line"), measured()
    part = frame[frame["specimen"] == "G0"].drop(columns=["specimen", "temperature_C"])
    part["force_N"] /= 1000.0
    renamed = part.rename(columns={"force_N": "Load [kN]"})
    renamed.to_csv(folder / "G0.csv", index=False)
    whole = read_fleet(frame, SIZES)
    found = read_fleet(folder)
    # Of G0 the temperature was 20 °C anyway.
    assert found.sums.xy == pytest.approx(whole.sums.xy)


def test_other_folders_mean_what_they_did(tmp_path):
    folder = as_cases(tmp_path / "line")
    assert gear_files(folder / "G0") == []
    assert gear_files(tmp_path / "none") == []
    measured().to_csv(folder / "G1.csv", index=False)
    assert any("as folders" in one for one in told(read_fleet, folder))
    measured().to_csv(folder / "data.csv", index=False)
    write_gear(folder / "gear.toml")
    assert gear_files(folder) == []
    same(read_fleet(folder), measured())


def test_the_command_reads_such_folders(here: Hdcal, tmp_path):
    as_cases(tmp_path / "line")
    # What is left has as many gears as in other tests: it is compiled already.
    shutil.rmtree(tmp_path / "line" / "G5")
    (tmp_path / "line" / "G2" / "data.csv").write_text("nothing\n")
    given = "fleet", "line", "--out", "out"
    refused = here(*given, "--specimen", "G1")
    assert refused.returncode == 2 and not (tmp_path / "out").exists()
    assert "G2/data.csv" in refused.stderr
    assert "--specimen: has no meaning with a folder of gears" in refused.stderr
    done = here(*given, "--skip-bad")
    assert done.returncode == 0, done.stderr
    answer = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    assert answer["gears"] == GEARS - 2 and answer["at_one_size"]
    assert [one["gear"] for one in answer["left_out"]] == ["G2"]
    # Walls that differ by a fifth are no scatter.
    assert answer["population"]["gear_sd_percent"]["median"] < 3.0


def test_what_is_not_read_is_said(tmp_path):
    folder = as_files(tmp_path / "line")
    (folder / "G9.txt").write_text("deformation_mm;force_N\n")
    (folder / "more").mkdir()
    (note,) = (n for n in read_fleet(folder).case.notes if n.startswith("not read"))
    assert "G9.txt, more" in note
    first = folder / "G0.csv"
    first.rename(folder / "G1.CSV")
    assert any("'G1' is the name of several files" in one for one in told(read_fleet, folder))


def test_what_some_files_state_is_not_read_and_that_is_said(tmp_path):
    folder = as_files(tmp_path / "line")
    one = pd.read_csv(folder / "G0.csv")
    one.assign(time_s=range(len(one))).to_csv(folder / "G0.csv", index=False)
    notes = read_fleet(folder).case.notes
    assert f"time is not read: 1 of {GEARS} files state it" in notes


def test_one_gear_of_a_folder_is_a_case_of_its_own(tmp_path):
    folder = as_files(tmp_path / "line")
    alone = read_case(folder, specimen="G1")
    assert np.array_equal(
        alone.records.force, read_case(folder / "G1.csv").records.force
    )
    assert any(
        "none is called 'G99'" in one for one in told(read_case, folder, specimen="G99")
    )
    assert any(
        "a file for each gear, not one case" in one for one in told(read_case, folder)
    )
    # A file called as one of the gears that it names itself.
    one = read_case(folder / "G1.csv").name
    assert alone.name == one == "G1"
    measured().to_csv(folder / "G1.csv", index=False)
    named = read_case(folder, specimen="G1")
    assert named.specimen_labels == ("G1",)
    assert np.array_equal(named.records.force, alone.records.force)


def test_files_of_a_folder_may_be_of_any_kind(tmp_path):
    folder, frame = as_files(tmp_path / "line"), measured()
    for place, kind in enumerate(("xlsx", "parquet", "tsv")):
        part = frame[frame["specimen"] == f"G{place}"].drop(columns="specimen")
        (folder / f"G{place}.csv").unlink()
        write = {"xlsx": part.to_excel, "parquet": part.to_parquet, "tsv": part.to_csv}
        write[kind](folder / f"G{place}.{kind}", index=False)
    (folder / "remarks.txt").write_text("measured on a Friday\n")
    same(read_fleet(folder), frame)
