"""Results from before there was a stamp are known by what they hold."""

from pathlib import Path

import pytest

from hdcal.errors import InputError
from hdcal.report.saving.contents import STAMP
from hdcal.report.saving.reserve import reserve_folder


def write(target: Path) -> None:
    """Write a result over an older one."""
    with reserve_folder(target, force=True) as place, place.filled() as building:
        (building / "summary.json").write_text("new")


def content(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def unstamped(folder: Path, answer: str, schema: str, *files: str) -> Path:
    """Write what an hdcal without stamps wrote."""
    folder.mkdir(parents=True)
    (folder / answer).write_text(f'{{\n  "schema": "{schema}",\n  "status": "ok"\n}}')
    for file in files:
        (folder / file).write_text(file)
    return folder


# What v0.1.0 wrote, by command.
OLD = {
    "calibrate": (
        *("summary.json", "hdcal.calibration/1", "posterior.nc", "bands.csv"),
        *("report.html", "calibration.svg", "calibration.png"),
    ),
    "dynamic": (
        *("summary.json", "hdcal.dynamic-calibration/1", "posterior.nc"),
        *("motion.csv", "motion.svg", "motion.png", "report.html"),
    ),
    "diagnose": (
        *("verdict.json", "hdcal.verdict/1", "posterior.nc", "posterior-none.nc"),
        *("posterior-contact_onset.nc", "bands.csv", "report.html", "bands.svg"),
        *("bands.png", "where.svg", "where.png", "which.svg", "which.png"),
        *("shrink.svg", "shrink.png", ".DS_Store"),
    ),
    "respond": (
        *("response.json", "hdcal.response/1", "response.csv", "response.svg"),
        *("response.png", "report.html"),
    ),
    "fit": ("fit.json", "hdcal.fit/1", "fit.svg", "fit.png", "report.html"),
    "design": (
        *("design.json", "hdcal.design/1", "design.svg", "design.png"),
        *("profile.svg", "profile.png", "report.html"),
    ),
    "study": (
        *("study.json", "hdcal.study/1", "study.csv", "study.svg", "study.png"),
        "report.html",
    ),
    "margin": (
        *("margin.json", "hdcal.margin/1", "margin.svg", "margin.png"),
        *("tornado.svg", "tornado.png", "report.html"),
    ),
    "blind": (
        *("scores.json", "hdcal.blind-scores/1", "opening.json", "labels.json"),
        *("bar.svg", "bar.png", "confusion.svg", "confusion.png", "detection.svg"),
        *("detection.png", "reliability.svg", "reliability.png", "report.html"),
    ),
}


@pytest.mark.parametrize("command", OLD)
def test_a_result_of_an_older_hdcal_is_recognised(command: str, tmp_path: Path):
    run = unstamped(tmp_path / "run", *OLD[command])
    (run / "thesis.txt").touch()
    with pytest.raises(InputError, match=r"'thesis\.txt', which hdcal did not write"):
        reserve_folder(run, force=True)
    (run / "thesis.txt").unlink()
    write(run)
    assert content(run).keys() == {STAMP, "summary.json"}
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_many_cases_of_an_older_hdcal_are_recognised(tmp_path: Path):
    for case in ("a", "b"):
        unstamped(tmp_path / "run" / case, *OLD["diagnose"])
    (tmp_path / "run" / "b" / "notes.txt").touch()
    with pytest.raises(InputError, match=r"'b/notes\.txt', which hdcal did not write"):
        reserve_folder(tmp_path / "run", force=True)
    (tmp_path / "run" / "b" / "notes.txt").unlink()
    write(tmp_path / "run")
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


@pytest.mark.parametrize(
    ("answer", "schema"),
    [("summary.json", "mine/1"), ("data.json", "hdcal.calibration/1")],
)
def test_names_alone_make_no_result(answer: str, schema: str, tmp_path: Path):
    run = unstamped(tmp_path / "run", answer, schema, "report.html", "bands.csv")
    before = content(tmp_path)
    with pytest.raises(InputError, match=r"'bands\.csv', which hdcal did not write"):
        reserve_folder(run, force=True)
    (run / answer).write_text("[" * 100_000)
    with pytest.raises(InputError, match=r"'bands\.csv', which hdcal did not write"):
        reserve_folder(run, force=True)
    before[f"run/{answer}"] = (run / answer).read_bytes()
    assert content(tmp_path) == before
