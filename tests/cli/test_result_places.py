"""A command refuses an impossible target before its work and keeps other files."""

import json
import os
import subprocess
from pathlib import Path

import pytest
from commands import MAIN, XB1, Hdcal

from hdcal.report.saving import Target

# With more work to do than a test could wait for.
WRITING = [
    ["calibrate", XB1, "--draws", "1000000"],
    ["diagnose", XB1],
    ["fit", XB1],
]


@pytest.mark.parametrize("asked", WRITING, ids=lambda asked: asked[0])
def test_an_impossible_target_is_refused_first(
    asked: list, here: Hdcal, tmp_path: Path
):
    def problem(*more: str) -> str:
        done = here(*asked, "--json", *more)
        assert done.returncode == 2
        (finding,) = json.loads(done.stdout)["findings"]
        return finding["problem"]

    with Target("run"):
        assert "by another process" in problem("--out", "run")
        assert "by another process" in problem("--out", "run", "--force")
    assert problem("--out", "none/run") == "its parent folder does not exist"
    assert problem("--out", "x" * 300)
    Path("mine").mkdir()
    assert "exists already" in problem("--out", "mine")
    assert "is not a result of hdcal" in problem("--out", "mine", "--force")
    assert os.listdir(tmp_path) == ["mine"] and not os.listdir("mine")


@pytest.mark.parametrize(
    "command", ["check", "calibrate", "diagnose", "fit", "fleet", "causes"]
)
def test_a_result_is_no_data(command: str, here: Hdcal, tmp_path: Path):
    with Target("run") as target, target.filled() as folder:
        (folder / "bands.csv").write_text("deformation_mm,force_N\n0.1,20\n")
    done = here(command, "run", "--json")
    assert done.returncode == 2 and os.listdir(tmp_path) == ["run"]
    (finding,) = json.loads(done.stdout)["findings"]
    assert finding["problem"] == "is a result of hdcal, not data"
    assert "predict, margin" in finding["remedy"]


def test_a_table_of_another_program_is_kept(here: Hdcal, calibrated, tmp_path: Path):
    asked = ["predict", calibrated[1], "--deformation", "0.1", "--out"]
    (tmp_path / "readings.csv").write_text("deformation_mm,force_N\n0.1,20\n")
    assert here(*asked, "readings.csv", "--force").returncode == 2
    assert (tmp_path / "readings.csv").read_text().endswith("0.1,20\n")
    for more, code in (([], 0), ([], 2), (["--force"], 0)):
        assert here(*asked, "bands.csv", *more).returncode == code
    assert {*os.listdir(tmp_path)} == {"readings.csv", "bands.csv"}


def test_a_full_disk_keeps_the_older_result(here: Hdcal, tmp_path: Path):
    asked = ["fit", str(XB1), "--out", "run"]
    assert here(*asked).returncode == 0
    before = (tmp_path / "run" / "hdcal-result.json").read_bytes()
    # The kernel refuses in the middle of report.html.
    limited = ["sh", "-c", 'ulimit -f 16; exec "$@"', "sh", *MAIN, *asked]
    done = subprocess.run(
        [*limited, "--force", "--json"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 1 and len(done.stderr.splitlines()) == 1
    assert json.loads(done.stdout)["status"] == "error"
    assert (tmp_path / "run" / "hdcal-result.json").read_bytes() == before
    assert os.listdir(tmp_path) == ["run"]
