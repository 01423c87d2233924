"""`hdcal diagnose` answers for one case or many, and writes all of it or nothing."""

import json
import operator
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest
from commands import XB1, Hdcal
from schema_checks import obeys
from verdicts import KINDS

from hdcal.cli.console import Console
from hdcal.cli.processes import run_all
from hdcal.data.reading import read_case
from hdcal.diagnosis.answer import RefusedAnswer, VerdictAnswer, VerdictsAnswer
from hdcal.diagnosis.many_cases import AskedCases, diagnose_all
from hdcal.diagnosis.summary import write_verdict
from hdcal.errors import Finding, InputError
from hdcal.report.saving import MARKER

FILES = {
    "report.html",
    "verdict.json",
    *("where.svg", "which.svg", "shrink.svg"),
    *("where.png", "which.png", "shrink.png"),
}


def pretend(case, *, library, quick=False, seed=0, progress=None):
    """Return the verdict that a case's name asks for."""
    if case.name == "defect":
        raise ValueError("broken")
    if case.name == "refused":
        raise InputError([Finding(case.name, "is refused", "Take another")])
    verdict = KINDS.get(case.name, KINDS["named"])()
    named = replace(verdict.case, name=case.name)
    made = {"seed": seed, "quick": quick}
    return replace(verdict, case=named, library=tuple(library), **made)


def choose(spec, registry):
    """Return the library without one effect."""
    missing = set((spec or "").removeprefix("minus:").split(",")) - {""}
    if missing - registry.keys():
        raise InputError([Finding("--library", "names no effect", "See hdcal effects")])
    return {name: effect for name, effect in registry.items() if name not in missing}


@pytest.fixture
def diagnose(monkeypatch: pytest.MonkeyPatch, here: Hdcal) -> Hdcal:
    """Run `hdcal diagnose` with make-believe verdicts."""
    for name, function in (("diagnose", pretend), ("library", choose)):
        module = ModuleType(name)
        setattr(module, "choose_library" if name == "library" else name, function)
        monkeypatch.setitem(sys.modules, f"hdcal.diagnosis.{name}", module)
    return lambda *arguments: here("diagnose", *arguments)


@pytest.fixture
def cases(tmp_path: Path) -> dict[str, Path]:
    """Cases whose names say what comes out."""
    folders = {}
    for name in [*KINDS, "defect", "refused"]:
        folders[name] = tmp_path / "cases" / name
        folders[name].mkdir(parents=True)
        for file in ("data.csv", "gear.toml"):
            (folders[name] / file).write_bytes((XB1 / file).read_bytes())
    return folders


def names(folder: Path) -> set[str]:
    """Return what lies in a folder."""
    return {path.name for path in folder.iterdir()}


def test_one_case_fills_the_folder_itself(diagnose, cases, tmp_path: Path):
    done = diagnose(cases["named"], "--out", "run", "--json", "--seed", "3")
    assert done.returncode == 0, done.stderr
    assert names(tmp_path / "run") == FILES | {MARKER}
    found = json.loads((tmp_path / "run" / "verdict.json").read_text("utf-8"))
    obeys(found, VerdictAnswer)
    assert json.loads(done.stdout) == found
    assert found["seed"] == 3 and not found["quick"]


def test_the_folder_is_named_after_the_case(diagnose, cases, tmp_path: Path):
    assert diagnose(cases["none"], "--no-report").returncode == 0
    assert names(tmp_path / "none-diagnosis") == {"verdict.json", MARKER}


@pytest.mark.usefixtures("undrawn")
def test_many_cases_get_a_folder_each(diagnose, cases, tmp_path: Path):
    (tmp_path / "a.csv").write_bytes((XB1 / "data.csv").read_bytes())
    (tmp_path / "gear.toml").write_bytes((XB1 / "gear.toml").read_bytes())
    asked = [cases["named"], cases["none"], "a.csv", "--json", "--out", "all"]
    done = diagnose(*asked, "--report")
    assert done.returncode == 0, done.stderr
    assert names(tmp_path / "all") == {"named", "none", "a", MARKER}
    for name in ("named", "none", "a"):
        assert names(tmp_path / "all" / name) == FILES
    asked.append("--no-report")
    said = json.loads(done.stdout)["cases"]
    assert list(said) == ["named", "none", "a"]
    assert said["none"]["which"]["verdict"] == "none"
    assert "2 named, 1 none" in done.stderr
    # An older result of many cases may be replaced, but nothing else.
    assert diagnose(*asked).returncode == 2
    assert diagnose(*asked, "--force").returncode == 0
    (tmp_path / "all" / "named" / "notes.txt").write_text("mine")
    refused = diagnose(*asked, "--force")
    assert refused.returncode == 2 and "'named/notes.txt'" in refused.stderr


def test_a_failed_case_is_written_and_told_by_the_exit_code(
    diagnose, cases, tmp_path: Path
):
    done = diagnose(cases["failed"], "--out", "alone")
    assert done.returncode == 1 and "FAILED" in done.stdout
    for file in ("report.html", "where.svg"):
        assert "FAILED — do not use" in (tmp_path / "alone" / file).read_text("utf-8")
    done = diagnose(cases["failed"], cases["none"], "--out", "all", "--no-report")
    assert done.returncode == 1


def test_everything_wrong_with_any_case_is_said_at_once(
    diagnose, cases, tmp_path: Path
):
    (cases["none"] / "data.csv").write_text("deformation_mm\n1\n")
    (cases["named"] / "gear.toml").write_text("[gear]\nname = 1\n")
    (tmp_path / "file").touch()
    before = set(tmp_path.rglob("*"))
    done = diagnose(
        *(cases["none"], cases["named"], cases["unknown"], "missing.csv"),
        *("--library", "minus:nothing", "--out", "file/below"),
    )
    assert done.returncode == 2 and not done.stdout
    for words in ("none/data.csv", "named/gear.toml", "missing.csv", "--library"):
        assert words in done.stderr
    assert "file/below" in done.stderr
    assert set(tmp_path.rglob("*")) == before


def test_a_refused_case_does_not_stop_the_others(diagnose, cases, tmp_path: Path):
    """Three are refused: by the reader, by the diagnosis, and for its name."""
    (cases["unknown"] / "data.csv").write_text("deformation_mm\n1\n")
    (tmp_path / "none").mkdir()
    for file in ("data.csv", "gear.toml"):
        (tmp_path / "none" / file).write_bytes((XB1 / file).read_bytes())
    asked = [*(cases[n] for n in ("none", "unknown", "refused", "named")), "none"]
    done = diagnose(*asked, "--no-report", "--out", "all", "--json")
    assert done.returncode == 2
    assert names(tmp_path / "all") == {"none", "named", "refused.json", MARKER}
    said = json.loads(done.stdout)
    obeys(said, VerdictsAnswer)
    assert list(said["cases"]) == ["none", "named"]
    assert list(said["refused"]) == [str(cases["unknown"]), "none", "refused"]
    assert "3 refused" in said["headline"] and said["status"] == "ok"
    written = json.loads((tmp_path / "all" / "refused.json").read_text("utf-8"))
    obeys(written, RefusedAnswer)
    assert written["cases"] == said["refused"]
    assert said["refused"]["refused"][0]["problem"] == "is refused"
    for words in ("a second case is called 'none'", "is refused", "column"):
        assert words in done.stderr
    # Such a result may be replaced like any other.
    assert diagnose(*asked, "--no-report", "--out", "all", "--force").returncode == 2


def test_a_case_named_as_a_file_of_the_result_does_not_stop_the_others(
    diagnose, cases, tmp_path: Path
):
    taken = [MARKER, "Refused.json"]
    for name in taken:
        (tmp_path / name).mkdir()
        for file in ("data.csv", "gear.toml"):
            (tmp_path / name / file).write_bytes((XB1 / file).read_bytes())
    asked = [cases["none"], *taken]
    done = diagnose(*asked, "--no-report", "--out", "all", "--json")
    assert done.returncode == 2
    assert names(tmp_path / "all") == {"none", "refused.json", MARKER}
    said = json.loads(done.stdout)
    assert list(said["cases"]) == ["none"] and list(said["refused"]) == taken
    for name in taken:
        words = f"is called '{name}', as is a file of the result"
        assert said["refused"][name][0]["problem"] == words
    # By itself it has no such neighbour.
    assert diagnose(MARKER, "--no-report", "--out", "one").returncode == 0


def test_where_every_case_is_refused_nothing_is_written(
    diagnose, cases, tmp_path: Path
):
    (cases["none"] / "data.csv").write_text("deformation_mm\n1\n")
    done = diagnose(cases["none"], cases["refused"])
    assert done.returncode == 2 and "is refused" in done.stderr
    assert "none/data.csv" in done.stderr
    assert names(tmp_path) == {"cases"}


def test_a_defect_leaves_nothing(diagnose, cases, tmp_path: Path):
    done = diagnose(cases["defect"], "--no-report")
    assert done.returncode == 1
    assert "internal error" in done.stderr and "Traceback" not in done.stderr
    assert names(tmp_path) == {"cases"}


@pytest.mark.parametrize("where", ["diagnosis", "report", "reader"])
def test_a_defect_in_one_case_does_not_stop_the_others(
    diagnose, monkeypatch, cases, tmp_path: Path, where: str
):
    broken = cases["defect"]
    if where == "report":
        broken = cases["unknown"]
        monkeypatch.setattr("hdcal.diagnosis.summary.write_verdict", half_written)
    if where == "reader":
        broken = cases["unknown"]
        monkeypatch.setattr("hdcal.diagnosis.many_cases.read_case", unreadable)
    asked = cases["none"], broken, cases["named"], "--out", "all", "--json"
    done = diagnose(*asked, *([] if where == "report" else ["--no-report"]))
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert names(tmp_path / "all") == {"none", "named", "refused.json", MARKER}
    said = json.loads(done.stdout)
    assert list(said["cases"]) == ["none", "named"]
    ((finding,),) = said["refused"].values()
    assert finding["problem"].startswith("internal error (ValueError: broken")
    assert "report it" in finding["remedy"] and "HDCAL_DEBUG=1" in finding["remedy"]
    assert "internal error" in done.stdout


def half_written(verdict, folder, command, *, report=True):
    """Write a verdict, or part of one."""
    if verdict.case.name == "unknown":
        (folder / "where.svg").touch()
        raise ValueError("broken within a report")
    return write_verdict(verdict, folder, command, report=False)


def unreadable(path, *rest, **options):
    """Read a case, unless a defect of the reader meets it."""
    if "unknown" in str(path):
        raise ValueError("broken")
    return read_case(path, *rest, **options)


def test_the_library_can_do_without_an_effect(diagnose, cases, tmp_path: Path):
    given = ["--library", "minus:outliers", "--no-report", "--out", "run"]
    assert diagnose(cases["named"], *given).returncode == 0
    found = json.loads((tmp_path / "run" / "verdict.json").read_text())
    assert "outliers" not in found["library"] and "coulomb_friction" in found["library"]


@pytest.mark.usefixtures("undrawn")
def test_with_many_cases_reports_have_to_be_asked_for(
    diagnose, monkeypatch, cases, tmp_path: Path
):
    monkeypatch.setattr(sys.modules["hdcal.diagnosis.command"], "MANY", 1)
    given = [cases["named"], cases["none"], "--out"]
    assert diagnose(*given, "plain").returncode == 0
    assert names(tmp_path / "plain" / "none") == {"verdict.json"}
    assert diagnose(*given, "full", "--report").returncode == 0
    assert names(tmp_path / "full" / "none") == FILES


def test_several_processes_give_the_same_in_the_same_order():
    tasks = [(2, power) for power in range(6)]
    told: list[tuple[int, int]] = []

    def tell(done: int, total: int) -> None:
        told.append((done, total))

    expected = [2**power for power in range(6)]
    assert run_all(operator.pow, tasks, 1) == expected
    assert run_all(operator.pow, tasks, 2, tell) == expected
    assert told == [(done, 6) for done in range(1, 7)]


@pytest.mark.thorough
def test_any_number_of_processes_writes_the_same_bytes(tmp_path: Path):
    found = [read_case(XB1), replace(read_case(XB1), name="again")]
    settings = {"library": None, "quick": True, "report": True, "seed": 3}
    for jobs in (1, 2):
        (tmp_path / str(jobs)).mkdir()
        settings |= {"jobs": jobs, "command": "hdcal diagnose"}
        diagnose_all(AskedCases(found, {}), tmp_path / str(jobs), **settings)
    one, two = (contents(tmp_path / jobs) for jobs in "12")
    assert len(one) == 2 * len(FILES) and one == two


def contents(folder: Path) -> dict[str, bytes]:
    """Return the bytes of every file below a folder, by its name there."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.parametrize("jobs", [[], ["--jobs", "2"], ["--jobs=2"]])
def test_the_number_of_processes_is_not_in_a_result(monkeypatch, jobs: list[str]):
    monkeypatch.setattr(sys, "argv", ["hdcal", "diagnose", "a", *jobs, "b --jobs 9"])
    assert Console(json=False).command == "hdcal diagnose a 'b --jobs 9'"


def test_an_error_in_another_process_comes_back():
    with pytest.raises(ZeroDivisionError):
        run_all(operator.truediv, [(1, 1), (1, 0), (1, 2)], 2)
