"""A result appears whole or not at all, and replaces nothing but a result of hdcal."""

import errno
import json
import os
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import killed_writer
import pytest
from killed_writer import TABLE, content, write_file, write_folder

from hdcal.errors import InputError, NotWritable
from hdcal.report.saving import MARKER, Target

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
FILES = {"summary.json", "case/verdict.json", MARKER}


def test_a_folder_is_there_only_when_it_is_complete(tmp_path: Path):
    with Target(str(tmp_path / "run")) as target:
        with target.filled() as folder:
            (folder / "summary.json").write_text("{}")
            assert not (tmp_path / "run").exists()
        assert content(tmp_path / "run").keys() == {"summary.json", MARKER}
    assert os.listdir(tmp_path) == ["run"]
    marker = json.loads((tmp_path / "run" / MARKER).read_text())
    assert marker["files"] == {"summary.json": sha256(b"{}").hexdigest()}


@pytest.mark.parametrize("write", [write_folder, write_file])
def test_a_result_is_replaced_with_force_only(write: Callable, tmp_path: Path):
    write(tmp_path / "run", "old")
    with pytest.raises(InputError, match="exists already"):
        write(tmp_path / "run", "new", force=False)
    assert set(content(tmp_path).values()) & {"old", TABLE + "old"}
    write(tmp_path / "run", "new")
    assert set(content(tmp_path).values()) & {"new", TABLE + "new"}
    assert os.listdir(tmp_path) == ["run"]


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("error", [KeyboardInterrupt(), FULL])
def test_a_failure_changes_nothing(error: BaseException, older: bool, tmp_path: Path):
    if older:
        write_folder(tmp_path / "run", "old")
    before = content(tmp_path)
    with (
        pytest.raises(NotWritable if error is FULL else type(error)),
        Target(str(tmp_path / "run"), force=True) as target,
        target.filled() as folder,
    ):
        (folder / "summary.json").write_text("new")
        raise error
    assert content(tmp_path) == before
    assert os.listdir(tmp_path) == ["run"] * older


@pytest.mark.parametrize("write", [write_folder, write_file])
@pytest.mark.parametrize(
    "call", ["os.fsync", "pathlib.Path.write_text", "pathlib.Path.rename"]
)
@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_disk_that_refuses_leaves_the_older_result(
    write: Callable, call: str, number: int, tmp_path: Path, monkeypatch
):
    write(tmp_path / "run", "old")
    before = content(tmp_path)
    module, _, name = call.rpartition(".")
    owner = os if module == "os" else Path
    real, calls = getattr(owner, name), []

    def refused(*given, **named):
        calls.append(name)
        if len(calls) == number + 1:
            raise FULL
        return real(*given, **named)

    with monkeypatch.context() as patch:
        patch.setattr(owner, name, refused)
        try:
            write(tmp_path / "run", "new")
        except NotWritable as error:
            assert os.strerror(errno.ENOSPC) in str(error)
            assert content(tmp_path) == before
        else:
            assert len(calls) <= number, "the error was ignored"
    assert os.listdir(tmp_path) == ["run"]


@pytest.mark.parametrize("call", ["pathlib.Path.mkdir", "os.open"])
def test_a_parent_that_is_read_only_is_refused_at_once(
    call: str, tmp_path: Path, monkeypatch
):
    def refused(*_, **__):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with monkeypatch.context() as patch:
        patch.setattr(call, refused)
        with pytest.raises(InputError, match="Read-only file system"):
            Target(str(tmp_path / "run"))
    assert not os.listdir(tmp_path)


def test_impossible_targets_are_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    inside = [f"{tmp_path}/{name}" for name in ("none/a", "file/a", "file", "x" * 250)]
    for name in (*inside, "", "/", "/proc/run"):
        with pytest.raises(InputError):
            Target(name, force=True)
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "readings.csv").write_text("deformation,force\n")
    for name in ("pipe", ".", "readings.csv"):
        with pytest.raises(InputError, match="was not written by hdcal"):
            Target(f"{tmp_path}/{name}", force=True, beginning=b"x")
    assert set(os.listdir(tmp_path)) == {"file", "pipe", "readings.csv"}


FOREIGN: dict[str, Callable[[Path], object]] = {
    "thesis.txt": lambda run: (run / "thesis.txt").touch(),
    "case/notes": lambda run: (run / "case" / "notes").touch(),
    "mine": lambda run: (run / "mine").mkdir(),
    "link": lambda run: (run / "link").symlink_to(run.parent),
    "summary.json": lambda run: (run / "summary.json").write_text("mine"),
    "case/verdict.json": lambda run: (run / "case" / "verdict.json").write_text("me"),
    MARKER: lambda run: (run / MARKER).write_text('{"files": [1]}'),
    "case": lambda run: (
        (run / "case").rename(run.parent / "moved"),
        (run / "case").symlink_to(run.parent / "moved"),
    ),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_what_hdcal_did_not_write_is_kept(name: str, tmp_path: Path):
    write_folder(tmp_path / "run", "old")
    FOREIGN[name](tmp_path / "run")
    before = content(tmp_path)
    with pytest.raises(InputError) as raised:
        Target(str(tmp_path / "run"), force=True)
    assert name in str(raised.value)
    assert content(tmp_path) == before
    assert (tmp_path / "run").is_dir() and not list(tmp_path.glob(".hdcal*"))


@pytest.mark.parametrize("name", ["thesis.txt", "summary.json"])
def test_what_is_changed_during_the_work_is_kept(name: str, tmp_path: Path):
    write_folder(tmp_path / "run", "old")
    (tmp_path / "run-2").touch()
    with (
        pytest.raises(InputError, match=r"the new result is in 'run-3'"),
        Target(str(tmp_path / "run"), force=True) as target,
        target.filled() as folder,
    ):
        (folder / "summary.json").write_text("new")
        FOREIGN[name](tmp_path / "run")
        before = content(tmp_path / "run")
    assert content(tmp_path / "run") == before
    assert content(tmp_path / "run-3")["summary.json"] == "new"
    assert not list(tmp_path.glob(".hdcal*"))


def test_a_file_that_appears_during_the_work_is_kept(tmp_path: Path):
    with (
        pytest.raises(InputError, match=r"the new result is in 'a-2\.csv'"),
        Target(str(tmp_path / "a.csv"), beginning=b"") as target,
        target.filled() as file,
    ):
        (tmp_path / "a.csv").write_text("mine")
        file.write_text("new")
    assert content(tmp_path) == {"a.csv": "mine", "a-2.csv": "new"}


@pytest.mark.parametrize("name", ["link", "there/../link", "there/run"])
def test_links_and_relative_paths_are_followed(name: str, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("there").mkdir()
    Path("link").symlink_to(tmp_path / "there" / "run")
    write_folder(Path(name), "old")
    write_folder(Path(name), "new")
    assert content(tmp_path / "there" / "run").keys() == FILES
    assert set(os.listdir(tmp_path)) == {"there", "link"} and Path("link").is_symlink()
    assert os.listdir("there") == ["run"]


@pytest.mark.parametrize("kind", ["folder", "file"])
@pytest.mark.parametrize("older", [False, True])
def test_a_kill_at_any_step_leaves_a_whole_result(
    kind: str, older: bool, tmp_path: Path
):
    script = [sys.executable, killed_writer.__file__, kind, str(int(older)), tmp_path]
    done = subprocess.run(script, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    outcomes = json.loads(done.stdout)
    assert len(outcomes) > {"folder": 15, "file": 10}[kind]
    for at_once, after_next_start, left in outcomes:
        assert after_next_start in ("new", "old" if older else None)
        # Between the two renames nothing is there; the older one is put back.
        assert at_once in (after_next_start, None) and left <= 1
    assert {last for _, last, _ in outcomes} == {"new", "old" if older else None}


def test_two_processes_never_write_one_target(tmp_path: Path):
    script = [sys.executable, killed_writer.__file__, "hold", str(tmp_path / "run")]
    (tmp_path / "link").symlink_to(tmp_path / "run")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(script, text=True, **pipes) as process:
        assert process.stdout is not None and process.stdout.readline()
        for name in ("run", "link", "./run"):
            with pytest.raises(InputError, match="is being written by another"):
                Target(f"{tmp_path}/{name}", force=True)
        write_folder(tmp_path / "other", "new")
        process.communicate("")
    assert process.returncode == 0
    assert content(tmp_path / "run").keys() == FILES
    assert set(os.listdir(tmp_path)) == {"run", "link", "other"}
