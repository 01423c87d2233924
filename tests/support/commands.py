"""The command line as a user runs it, and one result that many tests look at."""

import contextlib
import fcntl
import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from short import SHORT, options

ROOT = Path(__file__).parents[2]
XB1 = ROOT / "datasets" / "xb1-100-80"
MAIN = [sys.executable, "-m", "hdcal"]

Done = subprocess.CompletedProcess[str]
Hdcal = Callable[..., Done]


@pytest.fixture(scope="session")
def hdcal() -> Hdcal:
    """Run hdcal in a process of its own."""

    def run(*arguments: object, **options) -> Done:
        return subprocess.run(
            [*MAIN, *map(str, arguments)],
            capture_output=True,
            text=True,
            env={**os.environ, **options.pop("env", {})},
            timeout=300,
            **options,
        )

    return run


@pytest.fixture
def here(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Iterator[Hdcal]:
    """Run hdcal in this process, which has compiled already what others need."""
    from hdcal.__main__ import main

    before = signal.getsignal(signal.SIGTERM)

    def run(*arguments: object) -> Done:
        given = [str(argument) for argument in arguments]
        with pytest.raises(SystemExit) as ended:
            main(given)
        said = capsys.readouterr()
        code = ended.value.code
        assert isinstance(code, int)
        return subprocess.CompletedProcess(given, code, said.out, said.err)

    with contextlib.chdir(tmp_path):
        yield run
    signal.signal(signal.SIGTERM, before)


@pytest.fixture
def undrawn() -> Iterator[None]:
    """Draw no figures, which takes most of a report's time."""

    class Undrawn:
        def savefig(self, target: io.BytesIO, **_: object) -> None:
            target.write(b"<svg/>")

    from hdcal.report.charts import chart_drawing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chart_drawing, "draw", lambda _: Undrawn())
        yield


@pytest.fixture(scope="session")
def calibrated(
    hdcal: Hdcal, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Done, Path]:
    """A finished calibration of the bundled gear, and its folder.

    One process of a test run makes it; the others wait and take theirs from it.
    """
    place = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        place = place.parent
    place, said = place / "calibrated", place / "calibrated.json"
    with open(place.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            place.mkdir(exist_ok=True)
            asked = "calibrate", XB1, *options(SHORT), "--json", "--out"
            done = hdcal(*asked, place / "result")
            assert done.returncode == 0, done.stdout + done.stderr
            kept = done.args, done.returncode, done.stdout, done.stderr
            said.write_text(json.dumps(kept), "utf-8")
    kept = json.loads(said.read_text("utf-8"))
    return subprocess.CompletedProcess(*kept), place / "result"


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """A small case on disk, to be spoiled by the tests."""
    folder = tmp_path / "case"
    folder.mkdir()
    for name in ("data.csv", "gear.toml"):
        (folder / name).write_bytes((XB1 / name).read_bytes())
    return folder
