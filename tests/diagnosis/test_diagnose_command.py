"""`hdcal diagnose` answers for one case or many, and writes all of it or nothing."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from commands import XB1, Hdcal
from schema_checks import obeys

from hdcal.diagnosis import many_cases
from hdcal.diagnosis.many_cases import REFUSED, Diagnoses
from hdcal.diagnosis.result import Diagnosis
from hdcal.report.saving import MARKER

PAGE = {"report.html", "verdict.json", "where.svg", "which.svg", "how_far.svg"}


@pytest.fixture
def diagnose(here: Hdcal) -> Hdcal:
    return lambda *arguments: here("diagnose", "--quick", *arguments)


@pytest.fixture
def cases(tmp_path: Path) -> dict[str, Path]:
    """Cases by name: two good ones, one without scatter, one that is no table."""
    folders = {n: tmp_path / "cases" / n for n in ("one", "two", "line", "bad")}
    for folder in (*folders.values(), tmp_path / "one", tmp_path / "Refused.json"):
        folder.mkdir(parents=True)
        for file in ("data.csv", "gear.toml"):
            (folder / file).write_bytes((XB1 / file).read_bytes())
    rows = "".join(f"{0.1 * k:.1f},{20 * k}\n" for k in range(1, 9))
    (folders["line"] / "data.csv").write_text(f"deformation_mm,force_N\n{rows}")
    (folders["line"] / "gear.toml").write_text('[gear]\ntheory = "spring"\n')
    (folders["bad"] / "data.csv").write_text("deformation_mm\n1\n", "utf-8")
    return folders


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_one_case_fills_the_folder_itself(diagnose, cases, tmp_path: Path):
    run = tmp_path / "run"
    library = "--library", "minus:outliers,hysteresis"
    asked = cases["one"], "--out", "run", "--json", "--seed", "3", *library
    done = diagnose(*asked)
    assert done.returncode == 0, done.stderr
    assert PAGE | {MARKER} <= names(run)
    found = json.loads((run / "verdict.json").read_text("utf-8"))
    obeys(found, Diagnosis)
    assert json.loads(done.stdout) == found and found["seed"] == 3
    assert not {"outliers", "hysteresis"} & {*found["library"]}
    assert "coulomb_friction" in found["library"]
    # Only a result of this program may be replaced, and only when asked for.
    assert diagnose(*asked).returncode == 2
    assert diagnose(*asked, "--force", "--no-report").returncode == 0
    assert names(run) == {"verdict.json", MARKER}
    (run / "notes.txt").write_text("mine")
    assert diagnose(*asked, "--force").returncode == 2
    assert (run / "notes.txt").read_text() == "mine"


def test_a_refused_case_does_not_stop_the_others(diagnose, cases, tmp_path: Path):
    """Four are refused: by the reader, by the diagnosis, and two for their names."""
    given = "--no-report", "--out", "all", "--json"
    done = diagnose(*cases.values(), "one", "Refused.json", *given)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert names(tmp_path / "all") == {"one", "two", REFUSED, MARKER}
    found = json.loads(done.stdout)
    obeys(found, Diagnoses)
    assert [*found["cases"]] == ["one", "two"] and found["status"] == "ok"
    assert {*found["refused"]} == {str(cases["bad"]), "line", "one", "Refused.json"}
    written = json.loads((tmp_path / "all" / REFUSED).read_text("utf-8"))
    assert written == found
    for one in ("one", "two"):
        alone = json.loads((tmp_path / "all" / one / "verdict.json").read_text())
        assert alone == found["cases"][one]


def test_bad_input_is_refused_at_once_and_nothing_is_written(
    diagnose, cases, tmp_path: Path
):
    (tmp_path / "file").touch()
    before = contents(tmp_path)
    wrong = "--library", "minus:nothing", "--jobs", "0", "--out", "file/below"
    done = diagnose(cases["bad"], cases["one"], "missing.csv", *wrong)
    assert done.returncode == 2 and not done.stdout
    for words in ("bad/data.csv", "missing.csv", "library", "jobs", "file/below"):
        assert words in done.stderr
    for asked in ([cases["line"]], [cases["line"], cases["bad"]]):
        done = diagnose(*asked)
        assert done.returncode == 2 and "exactly on a straight line" in done.stderr
    assert contents(tmp_path) == before


@pytest.mark.parametrize(
    ("error", "code"), [(ValueError("broken"), 2), (KeyboardInterrupt, 130)]
)
def test_a_defect_stops_its_case_and_an_interruption_all(
    diagnose, cases, monkeypatch, tmp_path: Path, error, code: int
):
    right = many_cases.diagnose_into

    def broken(folder, case, **how):
        if case.name == "two":
            raise error
        return right(folder, case, **how)

    monkeypatch.setattr(many_cases, "diagnose_into", broken)
    done = diagnose(cases["one"], cases["two"], "--no-report", "--out", "all")
    assert done.returncode == code and "Traceback" not in done.stderr
    if code == 2:
        assert names(tmp_path / "all") == {"one", REFUSED, MARKER}
        refused = json.loads((tmp_path / "all" / REFUSED).read_text())["refused"]
        assert "ValueError: broken" in refused["two"][0]["problem"]
    else:
        assert not (tmp_path / "all").exists()
    alone = diagnose(cases["two"], "--out", "alone")
    assert alone.returncode == {2: 1, 130: 130}[code]
    assert not (tmp_path / "alone").exists()


def test_a_calibration_that_failed_is_marked_in_every_file(
    here: Hdcal, cases, monkeypatch, tmp_path: Path
):
    def fails(*_, **__):
        return SimpleNamespace(usable=False, reasons=("chains disagree",))

    monkeypatch.setattr("hdcal.calibration.calibrate.calibrate", fails)
    both = cases["one"], cases["two"], "--out", "all", "--json"
    done = here("diagnose", *both)
    assert done.returncode == 1
    answer = json.loads(done.stdout)
    assert [*answer["cases"]] == ["one", "two"]
    assert {why.partition(": ")[0] for why in answer["reasons"]} == {"one", "two"}
    assert all("checks: chains disagree" in why for why in answer["reasons"])
    assert done.stderr.count("FAILED") >= 2
    one = tmp_path / "all" / "one"
    found = json.loads((one / "verdict.json").read_text("utf-8"))
    obeys(found, Diagnosis)
    assert found["status"] == "failed" and not found["refits"]
    for file in PAGE - {"verdict.json"}:
        assert "FAILED" in (one / file).read_text("utf-8")
    assert "posterior.nc" not in names(one)
