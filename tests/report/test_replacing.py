"""Nothing is replaced or removed but what hdcal wrote, and nobody else writes."""

import errno
import json
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hdcal.errors import InputError
from hdcal.report.saving import disk
from hdcal.report.saving import target as target_module
from hdcal.report.saving.contents import STAMP
from hdcal.report.saving.leftovers import finish
from hdcal.report.saving.reserve import reserve_file, reserve_folder
from hdcal.report.saving.target import KeptBeside

NEW = {STAMP, "summary.json"}
NUMBERS = {
    "schema": "hdcal.result/1",
    "files": [{"file": 5, "bytes": 4, "sha256": "0"}],
}


def content(folder: Path) -> dict[str, bytes | None]:
    """Return everything below a folder; None for a folder."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        if path.is_file()
        else None
        for path in folder.rglob("*")
    }


def write(target: Path, text: str, force: bool = False) -> None:
    """Write a result with a folder inside."""
    with reserve_folder(target, force=force) as place, place.filled() as building:
        (building / "summary.json").write_text(text)
        (building / "inner").mkdir()
        (building / "inner" / "verdict.json").write_text(text)


def edited(file: str) -> Callable[[Path], object]:
    """Return what changes a file without changing its size."""
    return lambda run: (run / file).write_text("mine")


FOREIGN: dict[str, tuple[Callable[[Path], object], str]] = {
    "a file": (lambda run: (run / "thesis.txt").touch(), "'thesis.txt', which hdcal"),
    "a file below": (lambda run: (run / "inner" / "a").touch(), "'inner/a', which"),
    "an empty folder": (lambda run: (run / "mine").mkdir(), "'mine', which"),
    "a folder": (
        lambda run: (run / "mine" / "deep").mkdir(parents=True),
        "'mine', which",
    ),
    "a link": (lambda run: (run / "link").symlink_to(run.parent), "'link', which"),
    "a name that steers": (lambda run: (run / "a\x1b[31m").touch(), "'a\ufffd[31m'"),
    "an edited file": (edited("summary.json"), "'summary.json', which was edited"),
    "an edited one below": (
        edited("inner/verdict.json"),
        "'inner/verdict.json', which was edited",
    ),
    "an edited stamp": (edited(STAMP), f"'{STAMP}', which was edited"),
    "a stamp of numbers": (
        lambda run: (run / STAMP).write_text(json.dumps(NUMBERS)),
        f"'{STAMP}', which was edited",
    ),
    "a file that is now a link": (
        lambda run: (
            (run / "summary.json").rename(run.parent / "moved"),
            (run / "summary.json").symlink_to(run.parent / "moved"),
        ),
        "'summary.json', which was edited",
    ),
    "a folder that is now a link": (
        lambda run: (
            (run / "inner").rename(run.parent / "moved"),
            (run / "inner").symlink_to(run.parent / "moved"),
        ),
        "'inner', which",
    ),
    "litter that is a folder": (
        lambda run: (run / ".DS_Store").mkdir(),
        "'.DS_Store', which",
    ),
}


@pytest.mark.parametrize("kind", FOREIGN)
def test_what_hdcal_did_not_write_is_refused_at_once(kind: str, tmp_path: Path):
    change, words = FOREIGN[kind]
    write(tmp_path / "run", "text")
    change(tmp_path / "run")
    before = content(tmp_path)
    with pytest.raises(InputError, match=re.escape(words)):
        reserve_folder(tmp_path / "run", force=True)
    assert content(tmp_path) == before


@pytest.mark.parametrize("kind", FOREIGN)
def test_what_comes_meanwhile_stays_and_the_result_goes_beside(
    kind: str, tmp_path: Path
):
    change, words = FOREIGN[kind]
    write(tmp_path / "run", "text")
    with (
        pytest.raises(KeptBeside, match=re.escape(words)) as raised,
        reserve_folder(tmp_path / "run", force=True) as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("new")
        change(tmp_path / "run")
        before = content(tmp_path / "run")
    assert "in 'run-2'" in str(raised.value)
    assert content(tmp_path / "run") == before
    assert content(tmp_path / "run-2").keys() == NEW
    assert {path.name for path in tmp_path.iterdir()} - {"moved"} == {"run", "run-2"}


@pytest.mark.parametrize("kind", [kind for kind in FOREIGN if "litter" not in kind])
def test_what_comes_in_the_last_moment_stays_too(
    kind: str, tmp_path: Path, monkeypatch
):
    change, _ = FOREIGN[kind]
    write(tmp_path / "run", "text")
    exchange = target_module.exchange

    def late(one: Path, other: Path) -> bool:
        change(other)
        late_content.update(content(other))
        return exchange(one, other)

    late_content: dict = {}
    monkeypatch.setattr(target_module, "exchange", late)
    with (
        pytest.raises(KeptBeside, match="what was there lies in 'run-2'"),
        reserve_folder(tmp_path / "run", force=True) as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("new")
    assert content(tmp_path / "run").keys() == NEW
    assert content(tmp_path / "run-2") == late_content
    assert {path.name for path in tmp_path.iterdir()} - {"moved"} == {"run", "run-2"}


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("kind", ["empty folder", "folder", "file"])
def test_a_target_that_appears_is_kept(
    known: bool, kind: str, tmp_path: Path, monkeypatch
):
    if not known:
        monkeypatch.setattr("hdcal.report.saving.disk._rename", lambda *_: False)
    (tmp_path / "run-2").touch()
    with (
        pytest.raises(KeptBeside, match=r"appeared .* in 'run-3'"),
        reserve_folder(tmp_path / "run", force=True) as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("new")
        if kind == "file":
            (tmp_path / "run").write_text("mine")
        else:
            (tmp_path / "run").mkdir()
        if kind == "folder":
            (tmp_path / "run" / "mine").touch()
        before = content(tmp_path)
    after = content(tmp_path)
    assert {key: after[key] for key in before if not key.startswith(".")}.items() >= {
        key: value for key, value in before.items() if not key.startswith(".")
    }.items()
    assert content(tmp_path / "run-3").keys() == NEW
    assert {path.name for path in tmp_path.iterdir()} == {"run", "run-2", "run-3"}


def test_a_file_that_appears_or_is_edited_is_kept(tmp_path: Path):
    target = tmp_path / "a.csv"
    with (
        pytest.raises(KeptBeside, match=r"appeared .* in 'a-2\.csv'"),
        reserve_file(target, force=True, beginning="bands") as place,
    ):
        target.write_text("mine")
        place.write(b"bands")
    target.write_text("bands")
    with (
        pytest.raises(KeptBeside, match=r"is no table .* in 'a-3\.csv'"),
        reserve_file(target, force=True, beginning="bands") as place,
    ):
        target.write_text("mine")
        place.write(b"bands")
    there = {"a.csv": b"mine", "a-2.csv": b"bands", "a-3.csv": b"bands"}
    assert content(tmp_path) == there


def test_what_a_file_holds_is_compared_in_bytes(tmp_path: Path):
    target = tmp_path / "a.csv"
    target.write_text("ä,b\n1,2\n", "utf-8")
    with reserve_file(target, force=True, beginning="ä,b\n") as place:
        place.write(b"new")
    assert content(tmp_path) == {"a.csv": b"new"}


def test_rows_added_to_a_table_meanwhile_are_kept(tmp_path: Path):
    target = tmp_path / "a.csv"
    target.write_text("bands\n1\n")
    with (
        pytest.raises(KeptBeside, match=r"was edited .* in 'a-2\.csv'"),
        reserve_file(target, force=True, beginning="bands") as place,
    ):
        target.write_text("bands\n1\nmine\n")
        place.write(b"bands\n2\n")
    there = {"a.csv": b"bands\n1\nmine\n", "a-2.csv": b"bands\n2\n"}
    assert content(tmp_path) == there


@pytest.mark.parametrize("kind", ["rows", "folder", "result"])
def test_a_table_edited_in_the_last_moment_is_kept(
    kind: str, tmp_path: Path, monkeypatch
):
    target = tmp_path / "a.csv"
    target.write_text("bands\n1\n")
    exchange = target_module.exchange
    kept: dict = {}

    def late(one: Path, other: Path) -> bool:
        if kind == "rows":
            other.write_text("bands\n1\nmine\n")
            kept["a-2.csv"] = other.read_bytes()
        else:
            other.unlink()
            other.mkdir()
            kept["a.csv-2"] = None
        if kind == "result":
            write(tmp_path / "run", "text")
            other.rmdir()
            (tmp_path / "run").rename(other)
            kept.update({f"a.csv-2/{name}": v for name, v in content(other).items()})
        return exchange(one, other)

    monkeypatch.setattr(target_module, "exchange", late)
    with (
        pytest.raises(KeptBeside, match="what was there lies in 'a"),
        reserve_file(target, force=True, beginning="bands") as place,
    ):
        place.write(b"bands\n2\n")
    assert content(tmp_path) == {"a.csv": b"bands\n2\n", **kept}


def test_a_target_that_goes_away_in_the_last_moment_is_made(
    tmp_path: Path, monkeypatch
):
    exchange = target_module.exchange

    def late(one: Path, other: Path) -> bool:
        other.rename(tmp_path / "kept")
        return exchange(one, other)

    monkeypatch.setattr(target_module, "exchange", late)
    write(tmp_path / "run", "text")
    write(tmp_path / "run", "new", force=True)
    assert (tmp_path / "run" / "summary.json").read_text() == "new"
    assert (tmp_path / "kept" / "summary.json").read_text() == "text"
    (tmp_path / "kept" / "a.csv").write_text("bands old")
    (tmp_path / "kept" / "a.csv").rename(tmp_path / "a.csv")
    (tmp_path / "kept").rename(tmp_path / "first")
    with reserve_file(tmp_path / "a.csv", force=True, beginning="bands") as place:
        place.write(b"bands new")
    assert (tmp_path / "a.csv").read_bytes() == b"bands new"
    assert (tmp_path / "kept").read_bytes() == b"bands old"
    there = {path.name for path in tmp_path.iterdir()}
    assert there == {"run", "first", "a.csv", "kept"}


@pytest.mark.parametrize("moment", ["before", "after", "between"])
def test_an_interruption_of_the_rename_learns_from_the_disk_what_is_written(
    moment: str, tmp_path: Path, monkeypatch
):
    """It comes before or after two names are swapped, or between two renames."""
    rename = disk._rename

    def interrupted(one: Path, other: Path, flag: int) -> bool:
        if moment == "between" and one.parent.name == "swapping":
            return False
        if moment == "after":
            rename(one, other, flag)
        monkeypatch.undo()
        raise KeyboardInterrupt

    write(tmp_path / "run", "text")
    before = content(tmp_path)
    with (
        pytest.raises(KeyboardInterrupt) as raised,
        reserve_folder(tmp_path / "run", force=True) as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("new")
        monkeypatch.setattr(disk, "_rename", interrupted)
    notes = getattr(raised.value, "__notes__", [])
    if moment == "after":
        assert notes == [f"{tmp_path / 'run'} is written"]
        assert (tmp_path / "run" / "summary.json").read_text() == "new"
    else:
        assert not notes and content(tmp_path) == before
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_an_older_result_that_resists_is_seen_whole_or_not_at_all(
    tmp_path: Path, monkeypatch
):
    write(tmp_path / "run", "text")
    unlink = Path.unlink

    def resisting(path: Path, *given) -> None:
        if path.name == "summary.json":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        unlink(path, *given)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", resisting)
        write(tmp_path / "run", "new", force=True)
    # A part of it is gone, and what is left is hidden until it can be removed.
    seen = {path.name for path in tmp_path.iterdir()}
    assert "run" in seen and len(seen) == 2
    (hidden,) = tmp_path.glob(".hdcal-*-*")
    assert not list(hidden.rglob("verdict.json")) and list(hidden.rglob(STAMP))
    write(tmp_path / "other", "text")
    assert {path.name for path in tmp_path.iterdir()} == {"run", "other"}
    assert (tmp_path / "run" / "summary.json").read_text() == "new"


def test_half_of_an_older_result_that_cannot_be_read_stays_hidden(
    tmp_path: Path, monkeypatch
):
    working = tmp_path / ".hdcal-0123456789ab-0123456789ab"
    write(tmp_path / "run", "text")
    (working / "removing").mkdir(parents=True)
    (tmp_path / "run").rename(working / "removing" / "run")

    def unreadable(path: Path) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    with monkeypatch.context() as patch:
        patch.setattr("hdcal.report.saving.contents.size_and_sha256", unreadable)
        with pytest.raises(PermissionError):
            finish(working)
    assert [path.name for path in tmp_path.iterdir()] == [working.name]


def test_an_older_result_is_read_once_more_and_not_twice(tmp_path: Path, monkeypatch):
    from hdcal.report.saving import contents

    write(tmp_path / "run", "text")
    read, reads = contents.size_and_sha256, []

    def counted(path: Path) -> tuple[int, str]:
        reads.append(path.name)
        return read(path)

    monkeypatch.setattr(contents, "size_and_sha256", counted)
    write(tmp_path / "run", "text", force=True)
    # At the start, before the swap and after it, and once for the new one's stamp.
    assert reads.count("summary.json") == 4


def test_a_target_that_goes_away_is_made(tmp_path: Path):
    write(tmp_path / "run", "text")
    with (
        reserve_folder(tmp_path / "run", force=True) as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("new")
        (tmp_path / "run").rename(tmp_path / "kept")
    assert content(tmp_path / "run").keys() == NEW
    assert content(tmp_path / "kept").keys() == NEW | {"inner", "inner/verdict.json"}


def test_a_place_where_a_disk_is_mounted_is_refused(tmp_path: Path, monkeypatch):
    (tmp_path / "run").mkdir()
    monkeypatch.setattr(os.path, "ismount", lambda path: path == tmp_path / "run")
    with pytest.raises(InputError, match="mounted"):
        reserve_folder(tmp_path / "run", force=True)


WRITER = """
import sys, time
from hdcal.report.saving.reserve import reserve_folder
with reserve_folder(sys.argv[1]) as place, place.filled() as building:
    (building / "summary.json").write_text("slow")
    print("at work", flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def writer(tmp_path: Path) -> Iterator[subprocess.Popen]:
    """Another process that has begun to write tmp_path/run."""
    command = [sys.executable, "-c", WRITER, str(tmp_path / "run")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, **pipes) as process:
        assert process.stdout is not None and process.stdout.readline()
        yield process
        process.kill()


def test_a_second_run_is_told_at_once_who_is_at_work(writer, tmp_path: Path):
    (tmp_path / "link").symlink_to(tmp_path / "run")
    for name in ("run", "link", "./run"):
        with pytest.raises(InputError) as raised:
            reserve_folder(f"{tmp_path}/{name}", force=True)
        who = f"process {writer.pid} on {platform.node()}"
        assert f"is being written by {who}" in str(raised.value)
    with reserve_folder(tmp_path / "other") as place, place.filled():
        pass
    writer.communicate("")
    assert writer.returncode == 0
    assert {path.name for path in tmp_path.iterdir()} == {"link", "run", "other"}
    assert content(tmp_path / "run").keys() == NEW


def test_a_lock_of_another_user_says_who_is_at_work(
    writer, tmp_path: Path, monkeypatch
):
    open_ = os.open

    def denied(path, flags: int, *given) -> int:
        # As the kernel does where the file is another user's.
        if str(path).endswith(".lock") and flags & os.O_RDWR:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return open_(path, flags, *given)

    monkeypatch.setattr(os, "open", denied)
    with pytest.raises(InputError) as raised:
        reserve_folder(tmp_path / "run")
    assert f"is being written by process {writer.pid} on" in str(raised.value)
    writer.kill()
    writer.wait()
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        reserve_folder(tmp_path / "run")


def test_the_lock_of_a_killed_run_is_recognised(writer, tmp_path: Path):
    writer.kill()
    writer.wait()
    assert sum(path.name.startswith(".hdcal-") for path in tmp_path.iterdir()) == 2
    with reserve_folder(tmp_path / "other") as place:
        assert [path.name for path in tmp_path.iterdir()] == [place.lock.path.name]
    assert not any(tmp_path.iterdir())


def test_what_others_named_alike_is_left_alone(tmp_path: Path):
    for name in (".hdcal-notes", ".hdcal-0123456789ab-x", ".hdcal-0123456789ab"):
        (tmp_path / name).mkdir()
    # Whoever can write here cannot have others' files removed.
    (tmp_path / "project" / "building").mkdir(parents=True)
    (tmp_path / "project" / "building" / "mine").touch()
    (tmp_path / ".hdcal-0123456789ab-0123456789ab").symlink_to(tmp_path / "project")
    before = content(tmp_path)
    write(tmp_path / "run", "text")
    assert before.keys() <= content(tmp_path).keys()


def test_a_folder_of_others_is_not_searched(tmp_path: Path, monkeypatch):
    write(tmp_path / "run", "text")
    (tmp_path / "run" / "home" / "deep").mkdir(parents=True)
    searched = []
    iterdir = Path.iterdir
    monkeypatch.setattr(Path, "iterdir", lambda p: (searched.append(p), iterdir(p))[1])
    with pytest.raises(InputError, match="'home', which hdcal did not write"):
        reserve_folder(tmp_path / "run", force=True)
    assert searched == [tmp_path / "run"]


def test_where_there_are_no_locks_results_are_written_all_the_same(
    tmp_path: Path, monkeypatch
):
    def refuse(*_) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr("fcntl.flock", refuse)
    # Of another process, dead or alive: nobody can know.
    leftover = tmp_path / ".hdcal-0123456789ab-0123456789ab" / "building"
    leftover.mkdir(parents=True)
    write(tmp_path / "run", "old")
    write(tmp_path / "run", "new", force=True)
    assert (tmp_path / "run" / "summary.json").read_text() == "new"
    assert leftover.exists()
