"""A result folder appears whole or not at all."""

import json
import os
from hashlib import sha256
from pathlib import Path

import pytest

from hdcal.errors import InputError, NotWritable
from hdcal.report.saving.contents import STAMP
from hdcal.report.saving.reserve import reserve_file, reserve_folder, write_whole

STAMPED = f"run/{STAMP}"


def names(folder: Path) -> list[str]:
    """Return everything below a folder."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


def write(target: Path, text: str = "{}", force: bool = False, **files: str) -> None:
    """Write a result whose summary is a text."""
    with reserve_folder(target, force=force) as place, place.filled() as building:
        (building / "summary.json").write_text(text)
        for name, content in files.items():
            (building / name).mkdir()
            (building / name / "verdict.json").write_text(content)


def test_nothing_is_seen_before_the_end(tmp_path: Path):
    with reserve_folder(tmp_path / "run") as place, place.filled() as building:
        (building / "summary.json").write_text("{}")
        assert not (tmp_path / "run").exists()
    assert names(tmp_path) == ["run", STAMPED, "run/summary.json"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_a_failure_leaves_nothing(error: type[BaseException], tmp_path: Path):
    with (
        pytest.raises(error),
        reserve_folder(tmp_path / "run") as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("{}")
        raise error
    assert names(tmp_path) == []


def test_a_failure_leaves_the_older_result(tmp_path: Path):
    write(tmp_path / "run", "old")
    with (
        pytest.raises(NotWritable, match="No space left"),
        reserve_folder(tmp_path / "run", force=True) as place,
        place.filled() as building,
    ):
        (building / "summary.json").write_text("new")
        raise OSError(28, "No space left on device")
    assert names(tmp_path) == ["run", STAMPED, "run/summary.json"]
    assert (tmp_path / "run" / "summary.json").read_text() == "old"


def test_force_replaces_the_whole_folder(tmp_path: Path):
    write(tmp_path / "run", "old", inner="{}")
    (tmp_path / "run" / "inner" / ".DS_Store").touch()
    write(tmp_path / "run", "new", force=True)
    assert names(tmp_path) == ["run", STAMPED, "run/summary.json"]
    assert (tmp_path / "run" / "summary.json").read_text() == "new"


def test_the_stamp_says_what_was_written(tmp_path: Path):
    write(tmp_path / "run", "{}", inner="[]")
    stamp = json.loads((tmp_path / STAMPED).read_text("utf-8"))
    assert stamp.pop("version") and stamp.pop("schema") == "hdcal.result/1"
    assert stamp == {
        "files": [
            {
                "file": name,
                "bytes": 2,
                "sha256": sha256((tmp_path / "run" / name).read_bytes()).hexdigest(),
            }
            for name in ("inner/verdict.json", "summary.json")
        ]
    }


def test_the_same_result_has_the_same_stamp(tmp_path: Path):
    write(tmp_path / "run", inner="[]")
    write(tmp_path / "again", inner="[]")
    assert (tmp_path / STAMPED).read_bytes() == (
        tmp_path / "again" / STAMP
    ).read_bytes()


def test_a_link_is_followed(tmp_path: Path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "there" / "run")
    write(tmp_path / "link", "old")
    write(tmp_path / "link", "new", force=True)
    inside = [f"there/{STAMPED}", "there/run/summary.json"]
    assert names(tmp_path) == ["link", "there", "there/run", *inside]
    assert (tmp_path / "link" / "summary.json").read_text() == "new"


def test_a_reserved_target_is_left_alone(tmp_path: Path):
    with reserve_folder(tmp_path / "run"):
        pass
    assert names(tmp_path) == []
    with pytest.raises(InputError, match="exists already"):
        reserve_folder(tmp_path)
    with pytest.raises(InputError, match="parent folder does not exist"):
        reserve_folder(tmp_path / "none" / "run")
    assert names(tmp_path) == []


def test_a_file_is_written_whole(tmp_path: Path):
    target = tmp_path / "bands.csv"
    with reserve_file(target) as place:
        assert not target.exists()
        place.write(b"a\n1\n", 0o600)
    assert os.stat(target).st_mode & 0o777 == 0o600
    with pytest.raises(InputError, match="exists already"):
        reserve_file(target)
    with pytest.raises(InputError, match="exists already"):
        write_whole(target, "a\n2\n")
    assert target.read_text() == "a\n1\n"
    with reserve_file(target, force=True, beginning="a\n") as place:
        place.write(b"a\n2\n")
    assert target.read_text() == "a\n2\n"
    with pytest.raises(InputError, match="is a folder"):
        reserve_file(tmp_path, force=True)
    assert names(tmp_path) == ["bands.csv"]


def test_force_replaces_no_table_of_others(tmp_path: Path):
    target = tmp_path / "readings.csv"
    target.write_text("deformation_mm,force_N\n")
    os.mkfifo(tmp_path / "pipe")
    for path in (target, tmp_path / "pipe"):
        with pytest.raises(InputError, match="is no table that hdcal wrote"):
            reserve_file(path, force=True, beginning="deformation_mm,temperature_C,")
    assert target.read_text() == "deformation_mm,force_N\n"
    assert names(tmp_path) == ["pipe", "readings.csv"]


def test_what_is_seen_was_synced_before(tmp_path: Path, monkeypatch):
    synced: set[int] = set()
    seen: list[int] = []
    fsync, rename = os.fsync, os.rename

    def watched_fsync(descriptor: int) -> None:
        fsync(descriptor)
        synced.add(os.fstat(descriptor).st_ino)

    def watched_rename(source, *_) -> None:
        paths = [Path(source), *Path(source).rglob("*")]
        seen.extend(path.stat().st_ino for path in paths)
        assert set(seen) <= synced
        rename(source, *_)

    # Where there is no rename in one step: each has to go through Python.
    monkeypatch.setattr("hdcal.report.saving.disk._rename", lambda *_: False)
    monkeypatch.setattr(os, "fsync", watched_fsync)
    monkeypatch.setattr(os, "rename", watched_rename)
    write(tmp_path / "run", inner="[]")
    assert len(seen) == 5
    assert tmp_path.stat().st_ino in synced
    with reserve_file(tmp_path / "bands.csv") as place:
        place.write(b"a\n")
    assert len(seen) == 6
