"""A disk that refuses costs the new result and nothing else, and one line says so."""

import errno
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import full_disks
import pytest
from commands import MAIN, XB1, Hdcal
from posteriors import single
from results import write_result
from short import SHORT, options

from hdcal.calibration.summary import calibration_report
from hdcal.errors import InputError, NotWritable
from hdcal.report.saving.contents import STAMP
from hdcal.report.saving.disk import write_file
from hdcal.report.saving.reserve import reserve_file, reserve_folder, write_whole

ERRORS = [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EIO]
CALLS = ["open", "write", "fsync"]


@pytest.fixture
def place() -> Iterator[Path]:
    """An empty folder, in memory where it can be: a disk takes its time to sync."""
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        yield Path(folder)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result of `hdcal calibrate`."""
    target = tmp_path_factory.mktemp("whole") / "run"
    write_result(calibration_report(single(size=400)), target)
    return target


FILES = [
    *("report.html", "summary.json", "bands.csv", "posterior.nc", STAMP),
    *("calibration.svg", "calibration.png"),
]


def content(folder: Path) -> dict[str, bytes]:
    """Return every file below a folder."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def refuse(patch: pytest.MonkeyPatch, call: str, file: str, number: int) -> None:
    """Let one call of the system fail for the files of a name, a write half-way."""
    real = {name: getattr(os, name) for name in CALLS}
    watched: set[int] = set()

    def failing() -> OSError:
        return OSError(number, os.strerror(number))

    def opened(path, *given, **named) -> int:
        if Path(path).name != file:
            return real["open"](path, *given, **named)
        if call == "open":
            raise failing()
        watched.add(descriptor := real["open"](path, *given, **named))
        return descriptor

    def written(descriptor: int, data) -> int:
        if call == "write" and descriptor in watched:
            real["write"](descriptor, data[: len(data) // 2])
            raise failing()
        return real["write"](descriptor, data)

    def synced(descriptor: int) -> None:
        if call == "fsync" and descriptor in watched:
            raise failing()
        real["fsync"](descriptor)

    patch.setattr(os, "open", opened)
    patch.setattr(os, "write", written)
    patch.setattr(os, "fsync", synced)


def write_again(files: dict[str, bytes], target: Path) -> None:
    """Write a result, over an older one if there is one."""
    with reserve_folder(target, force=True) as place, place.filled() as building:
        for name, data in files.items():
            write_file(building / name, data)


@pytest.mark.parametrize("older", [False, True])
@pytest.mark.parametrize("number", ERRORS)
def test_whatever_file_is_refused_nothing_is_left(
    older: bool, number: int, whole: Path, place: Path
):
    files = content(whole)
    assert files.keys() == set(FILES)
    del files[STAMP]
    if older:
        write_again({"summary.json": b"old"}, place / "run")
    before = content(place)
    for file in FILES:
        for call in CALLS:
            with pytest.MonkeyPatch.context() as patch:
                refuse(patch, call, file, number)
                with pytest.raises(NotWritable) as raised:
                    write_again(files, place / "run")
            assert os.strerror(number) in str(raised.value)
            assert "nothing of it was left" in str(raised.value)
            assert content(place) == before, (file, call)
            assert {path.name for path in place.iterdir()} <= {"run"}
    write_again(files, place / "run")
    assert content(place / "run").keys() == set(FILES)


@pytest.mark.parametrize("number", ERRORS)
@pytest.mark.parametrize("older", [False, True])
def test_a_folder_that_cannot_be_synced_is_whole_and_told(
    older: bool, number: int, place: Path
):
    if older:
        write_again({"summary.json": b"old"}, place / "run")
    with pytest.MonkeyPatch.context() as patch:
        refuse(patch, "fsync", place.name, number)
        with pytest.raises(NotWritable, match="may not outlast a loss of power"):
            write_again({"summary.json": b"new"}, place / "run")
    assert (place / "run" / "summary.json").read_bytes() == b"new"
    assert {path.name for path in place.iterdir()} == {"run"}


@pytest.mark.parametrize("renames", [True, False])
def test_a_name_that_is_refused_leaves_what_was_there(renames: bool, place: Path):
    """What fails last: the rename, after everything is written."""
    write_again({"summary.json": b"old"}, place / "run")
    before = content(place)

    def refused(*_) -> bool:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    for target in ("run", "new"):
        with pytest.MonkeyPatch.context() as patch:
            if renames:
                patch.setattr("hdcal.report.saving.disk._rename", refused)
            else:
                patch.setattr("hdcal.report.saving.disk._rename", lambda *_: False)
                patch.setattr(os, "rename", refused)
            with pytest.raises(NotWritable, match="nothing of it was left"):
                write_again({"summary.json": b"new"}, place / target)
        # What could not be renamed back either comes back at the next start.
        with reserve_folder(place / "another"):
            pass
        assert content(place) == before
        assert {path.name for path in place.iterdir()} == {"run"}


@pytest.mark.parametrize("number", [*ERRORS, errno.EACCES])
def test_before_any_work_it_is_bad_input(number: int, tmp_path: Path):
    with pytest.MonkeyPatch.context() as patch:
        with reserve_folder(tmp_path / "run") as place:
            lock = place.lock.path.name
        refuse(patch, "open", lock, number)
        for reserve in (reserve_folder, reserve_file):
            with pytest.raises(InputError, match="cannot be written"):
                reserve(tmp_path / "run")
        # In the middle of work it is the disk's fault.
        with pytest.raises(NotWritable, match="cannot be written"):
            write_whole(tmp_path / "run", "text")
    with pytest.MonkeyPatch.context() as patch:
        refuse(patch, "write", lock, number)
        with pytest.raises(InputError, match="cannot be written"):
            reserve_folder(tmp_path / "run")
    assert not any(tmp_path.iterdir())


def test_a_folder_that_vanishes_is_told(tmp_path: Path):
    place = tmp_path / "stick"
    place.mkdir()
    with (
        pytest.raises(NotWritable, match="No such file or directory"),
        reserve_folder(place / "run") as target,
        target.filled() as building,
    ):
        write_file(building / "summary.json", b"{}")
        shutil.rmtree(place)
    assert not any(tmp_path.iterdir())


def test_a_missing_input_is_no_fault_of_the_result(tmp_path: Path):
    missing = tmp_path / "data.csv"
    with (
        pytest.raises(FileNotFoundError, match=r"data\.csv"),
        reserve_folder(tmp_path / "run") as target,
        target.filled(),
    ):
        missing.read_bytes()
    assert not any(tmp_path.iterdir())


def test_a_command_names_the_input_that_went_away(
    here: Hdcal, monkeypatch, tmp_path: Path
):
    monkeypatch.setattr(
        "hdcal.classical.fit.summary.fit_report",
        lambda *_, **__: (tmp_path / "data.csv").read_bytes(),
    )
    done = here("fit", XB1, "--out", "run", "--json")
    assert done.returncode == 1 and not any(tmp_path.iterdir())
    words = "the system refused: No such file or directory: "
    assert f"{words}{tmp_path / 'data.csv'}" in done.stderr
    assert json.loads(done.stdout)["status"] == "error"


def test_a_command_says_it_in_one_line(here: Hdcal, tmp_path: Path):
    asked = ["fit", XB1, "--out", "run"]
    for more in ([], ["--json"]):
        with pytest.MonkeyPatch.context() as patch:
            refuse(patch, "write", "fit.png", errno.ENOSPC)
            done = here(*asked, *more)
        assert done.returncode == 1
        assert len(done.stderr.splitlines()) == 1
        assert "run: cannot be written (No space left on device)" in done.stderr
        assert bool(done.stdout) == bool(more)
        if more:
            assert json.loads(done.stdout)["status"] == "error"
        assert not any(tmp_path.iterdir())
    assert here(*asked).returncode == 0


@pytest.fixture
def own_mounts() -> Iterator[Callable[..., str]]:
    """Run a script where it may mount, and nobody else sees it."""
    command = ["unshare", "--map-root-user", "--mount"]
    if not shutil.which("unshare"):
        pytest.skip("unshare is missing: no disk can be mounted")
    if subprocess.run([*command, "true"], capture_output=True).returncode != 0:
        pytest.skip("this system lets no user mount a disk")

    def run(*given: object) -> str:
        done = subprocess.run(
            [*command, *map(str, given)], capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    yield run


def test_a_real_disk_may_be_full_at_any_byte(own_mounts, whole: Path, tmp_path: Path):
    need = sum(path.stat().st_size for path in whole.iterdir())
    script = Path(full_disks.__file__)
    size = 2 * need // 4096 * 4096
    outcomes = json.loads(own_mounts(sys.executable, script, whole, tmp_path, size))
    if outcomes is None:
        pytest.skip("this system lets no user mount a disk")
    said = [words for words, _ in outcomes]
    assert set(said) == {"full at once", "full", "written"}
    assert sum(words != "written" for words in said) >= 20
    assert all(same for words, same in outcomes if words != "written")


@pytest.mark.slow
@pytest.mark.parametrize("size", [256, 512, 1024])
def test_a_calibration_on_a_small_disk_fails_in_one_line(
    own_mounts, size: int, tmp_path: Path
):
    # Its posterior.nc alone takes more; HDF5 crashed when it wrote to such a disk.
    mount = f"mount -t tmpfs -o size={size}k none {tmp_path}"
    asked = ["calibrate", str(XB1), "--out", str(tmp_path / "run"), *options(SHORT)]
    command = shlex.join([*MAIN, *asked])
    script = f"{mount} && {{ {command} 2>&1; echo $?; ls -A {tmp_path}; }}"
    *_, said, code = own_mounts("sh", "-c", script).splitlines()
    assert "cannot be written (No space left on device)" in said
    assert code == "1"
