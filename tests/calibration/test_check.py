"""A check shows what was read: folders, certificates, files that are refused."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import Hdcal
from schema_checks import obeys

from hdcal.calibration.check.check import CaseCheck, check
from hdcal.data.reading import read_case

X = np.linspace(0.0, 0.5, 6)
SLOPES = {"A": 100.0, "B": 120.0, "C": 90.0}
HEADERS = {"A": "deformation_mm,force_N", "B": "deformation_um;Load [kN]"}
SIZES = "[gear]\nwall_thickness_mm = 0.68\nradius_mm = 40.0\nlength_mm = 70.0\n"
STATED_BY = """[measurement]
force_calibration = { expanded_percent = 0.27, expanded_N = 0.3, k = 3 }
deformation_calibration = { expanded_percent = 0.2, expanded_mm = 0.004 }
temperature_calibration = { expanded_K = 1.0 }
"""


@pytest.fixture
def line(tmp_path: Path) -> Path:
    """A folder with a file for each gear, one of them in units of its own."""
    (folder := tmp_path / "line").mkdir()
    for name, stiffness in SLOPES.items():
        header = HEADERS.get(name, HEADERS["A"])
        x, y, mark = (1e3, 1e-3, ";") if name == "B" else (1.0, 1.0, ",")
        rows = [f"{x * w:.6f}{mark}{y * stiffness * w:.6f}" for w in X]
        (folder / f"{name}.csv").write_text("\n".join([header, *rows]) + "\n")
    return folder


def test_a_folder_is_checked_as_a_fleet_is_read(here: Hdcal, line: Path):
    done = here("check", "line", "--json")
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    obeys(answer, CaseCheck)
    assert answer["data"]["specimens"] == [*SLOPES]
    assert answer["data"]["force_N"] == [0.0, 60.0]
    assert "`fleet`" in answer["next_step"] and answer["case"] == "line"
    one = here("check", "line", "--specimen", "C", "--json")
    assert json.loads(one.stdout)["data"]["rows"] == 6
    assert here("check", "line", "--specimen", "Z").returncode == 2


def test_findings_of_all_files_are_reported_at_once(here: Hdcal, line: Path):
    (line / "B.csv").write_text("")
    (line / "C.csv").write_text(HEADERS["A"] + "\n0.1,abc\n" + "0.2,1\n" * 5)
    done = here("check", "line", "--sheet", "Probe")
    assert done.returncode == 2
    for words in ("line/B.csv", "line/C.csv, row 2", "--sheet: cannot be combined"):
        assert words in done.stderr


def certificates(here: Hdcal, folder: Path, text: str, rows: str = "0.2") -> dict:
    readings = "".join(f"{i / 10},{20 * i},{rows}\n" for i in range(6))
    header = "deformation_mm,force_N,force_sd_N\n"
    (folder / "data.csv").write_text(header + readings)
    (folder / "gear.toml").write_text(SIZES + text)
    return json.loads(here("check", folder, "--json").stdout)


def test_each_certificate_is_shown_as_a_standard_uncertainty(tmp_path, here: Hdcal):
    answer = certificates(here, tmp_path, STATED_BY)
    found = {one["parameter"]: one for one in answer["certificates"]}
    sizes = {n: (one["standard_uncertainty"], one["unit"]) for n, one in found.items()}
    assert sizes == {
        "force_gain": (pytest.approx(0.09), "%"),
        "deformation_gain": (pytest.approx(0.1), "%"),
        "temperature_offset": (0.5, "K"),
        "force_offset": (pytest.approx(0.1), "N"),
        "deformation_offset": (0.002, "mm"),
    }
    assert all(one["certificate"] for one in found.values())
    assert any(note.startswith("force_sd is") for note in answer["notes"])
    # A prior of the gear file replaces a certificate.
    prior = '[priors]\nforce_offset = { family = "fixed", value = 0.0 }\n'
    answer = certificates(here, tmp_path, STATED_BY + prior)
    names = {one["parameter"] for one in answer["certificates"]}
    assert names == {*sizes} - {"force_offset"}
    assert certificates(here, tmp_path, "")["certificates"] == []


def test_the_picture_distinguishes_specimens_runs_or_movements():
    x = np.concatenate([X, X[-2::-1]])
    table = {"deformation_mm": x, "force_N": 100.0 * x + 0.1 * (np.arange(11) % 3)}
    halves = np.repeat(["a", "b"], [6, 5])

    def labels(table: dict) -> list[str]:
        chart = check(read_case(table)).charts()["readings"]
        return [mark.label for mark in chart.panels[0].marks]

    assert labels(table) == ["loading", "unloading"]
    assert labels(table | {"run": halves}) == ["run a", "run b"]
    assert labels(table | {"specimen": halves}) == ["specimen a", "specimen b"]
    assert labels({name: values[:6] for name, values in table.items()}) == [""]
