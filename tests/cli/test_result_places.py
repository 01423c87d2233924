"""A command says where its result is, or who is in its way, and by which exit code."""

import json
from pathlib import Path

import pytest
from commands import XB1, Hdcal

from hdcal.report.saving.reserve import reserve_folder

# What each command that writes is asked with --out; none gets so far as to read RUN.
WRITING = [
    ["calibrate", XB1, "--draws", "1000000"],
    ["diagnose", XB1],
    ["fit", XB1],
    ["study", "--gear", XB1 / "gear.toml", "--vary", "radius_mm=40"],
    ["design", "--gear", XB1 / "gear.toml", "--window", "0.3:0.5"],
    ["blind", "make", "--cases", "1000", "--mix", "prior", "--key", "key"],
]


@pytest.mark.parametrize("asked", WRITING, ids=lambda asked: asked[0])
def test_a_second_command_is_told_at_once(asked: list, here: Hdcal, tmp_path: Path):
    with reserve_folder("run"):
        for more in ([], ["--force"]):
            done = here(*asked, "--out", "run", *more, "--json")
            assert done.returncode == 2
            (finding,) = json.loads(done.stdout)["findings"]
            assert finding["problem"].startswith("is being written by process ")
    assert not any(tmp_path.iterdir())


def test_a_table_has_one_writer_too(here: Hdcal, calibrated, tmp_path: Path):
    asked = ["predict", calibrated[1], "--deformation", "0.1", "--out", "run"]
    with reserve_folder("run"):
        done = here(*asked)
    assert done.returncode == 2 and "is being written by process" in done.stderr
    (tmp_path / "readings.csv").write_text("deformation_mm,force_N\n0.1,20\n")
    done = here(*asked[:-1], "readings.csv", "--force")
    assert done.returncode == 2 and "no table that hdcal wrote" in done.stderr
    assert (tmp_path / "readings.csv").read_text().endswith("0.1,20\n")


def test_an_interruption_after_the_end_says_what_is_written(
    here: Hdcal, monkeypatch, tmp_path: Path
):
    def interrupted(*_) -> None:
        assert (tmp_path / "run" / "fit.json").exists()
        raise KeyboardInterrupt

    monkeypatch.setattr("hdcal.report.terminal.terminal_lines", interrupted)
    done = here("fit", XB1, "--out", "run")
    assert done.returncode == 130 and not done.stdout
    assert done.stderr.strip() == "hdcal: interrupted: run is written"
    assert {path.name for path in tmp_path.iterdir()} == {"run"}


def test_what_appears_meanwhile_is_kept_and_told(
    here: Hdcal, monkeypatch, tmp_path: Path
):
    from hdcal.classical.fit import summary

    report = summary.fit_report

    def slow(*given, **named):
        (tmp_path / "made").mkdir()
        (tmp_path / "made" / "thesis.txt").write_text("years of work")
        return report(*given, **named)

    monkeypatch.setattr(summary, "fit_report", slow)
    done = here("fit", XB1, "--out", "made", "--force", "--json")
    assert done.returncode == 2
    (finding,) = json.loads(done.stdout)["findings"]
    assert finding["file"] == "made" and "'made-2'" in finding["problem"]
    assert {path.name for path in tmp_path.iterdir()} == {"made", "made-2"}
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["thesis.txt"]
    answer = json.loads((tmp_path / "made-2" / "fit.json").read_text("utf-8"))
    assert answer["schema"] == "hdcal.fit/1"
