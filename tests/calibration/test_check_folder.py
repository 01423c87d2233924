"""A folder with a file for each gear is checked as a fleet is read."""

import json
from pathlib import Path

import numpy as np
from commands import Hdcal
from schema_checks import obeys

from hdcal.calibration.check.check import Check

STIFFNESS = {"A": 100.0, "B": 120.0, "C": 90.0}
HEADERS = {"A": "deformation_mm,force_N", "B": "deformation_um;Load [kN]"}
SCALES = {"B": (1e3, 1e-3)}


def folder_of_gears(place: Path) -> Path:
    """Write a file for each gear, one of them in units of its own."""
    place.mkdir()
    for name, stiffness in STIFFNESS.items():
        x, y = SCALES.get(name, (1.0, 1.0))
        header = HEADERS.get(name, HEADERS["A"])
        mark = ";" if ";" in header else ","
        rows = [
            f"{x * w:.6f}{mark}{y * stiffness * w:.6f}" for w in np.linspace(0, 0.5, 6)
        ]
        (place / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    return place


def test_each_gear_has_a_row_and_fleet_is_the_next_step(here: Hdcal, tmp_path: Path):
    folder_of_gears(tmp_path / "line")
    done = here("check", "line", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, Check)
    slopes = {s["name"]: s["stiffness_N_per_mm"] for s in answer["specimens"]}
    assert {name: round(slope, 6) for name, slope in slopes.items()} == STIFFNESS
    assert {s["rows"] for s in answer["specimens"]} == {6}
    assert "`fleet`" in answer["next_step"] and answer["case"] == "line"
    assert any("each file is a gear" in note for note in answer["notes"])
    assert "Specimens" in done.stderr


def test_each_folder_of_a_gear_has_its_gear_file(here: Hdcal, tmp_path: Path):
    folder_of_gears(tmp_path / "files")
    for name in STIFFNESS:
        (own := tmp_path / "line" / name).mkdir(parents=True)
        (tmp_path / "files" / f"{name}.csv").rename(own / "data.csv")
        sizes = "wall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
        (own / "gear.toml").write_text(f"[gear]\n{sizes}")
    answer = json.loads(here("check", "line", "--json").stdout)
    assert [s["name"] for s in answer["specimens"]] == [*STIFFNESS]
    assert answer["gear"]["theory"] == "ring"


def test_findings_of_all_files_are_reported_at_once(here: Hdcal, tmp_path: Path):
    folder = folder_of_gears(tmp_path / "line")
    (folder / "B.csv").write_text("")
    (folder / "C.csv").write_text(HEADERS["A"] + "\n0.1,abc\n" + "0.2,1\n" * 5)
    done = here("check", "line", "--sheet", "Probe")
    assert done.returncode == 2
    for words in ("line/B.csv", "line/C.csv, row 2", "--sheet: has no meaning"):
        assert words in done.stderr
    # A check leaves nothing out, and offers no such thing.
    assert "skip" not in done.stderr


def test_one_gear_of_it_is_checked_by_itself(here: Hdcal, tmp_path: Path):
    folder_of_gears(tmp_path / "line")
    answer = json.loads(here("check", "line", "--specimen", "C", "--json").stdout)
    assert answer["specimens"] == [] and answer["data"]["rows"] == 6
    done = here("check", "line", "--specimen", "Z")
    assert done.returncode == 2 and "none is called 'Z'" in done.stderr


def test_a_gear_file_for_all_of_them_can_be_written(here: Hdcal, tmp_path: Path):
    folder_of_gears(tmp_path / "line")
    done = here("check", "line", "--write-gear", "line/gear.toml")
    assert done.returncode == 0, done.stderr
    assert 'name = "line"' in (tmp_path / "line" / "gear.toml").read_text()
    assert here("check", "line").returncode == 0
