"""An interrupted command ends with code 130, its processes with it, and no files."""

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from commands import MAIN, XB1
from short import SHORT, options

WORK = (
    "import time; from hdcal.cli.processes import run_all\n"
    "if __name__ == '__main__': run_all(time.sleep, [(100,), (100,)], 2)"
)
SLOW = """
import pathlib, time
import hdcal.data.reading as reading
from hdcal.__main__ import main

def slow(*_, **__):
    try:
        print("begun", flush=True)
        time.sleep(100)
    finally:
        time.sleep(1)
        pathlib.Path("cleaned-up").touch()

reading.read_case = slow
main(["check", "case"])
"""


@pytest.mark.thorough
def test_an_interrupted_calibration_leaves_nothing(tmp_path: Path):
    # On a terminal the progress bar shows when sampling has begun.
    ours, theirs = pty.openpty()
    endless = options(SHORT | {"draws": 1_000_000})
    command = [*MAIN, "calibrate", str(XB1), *endless]
    with subprocess.Popen(
        command, cwd=tmp_path, stderr=theirs, stdout=subprocess.PIPE
    ) as process:
        os.close(theirs)
        printed = b""
        limit = time.monotonic() + 200
        while b"sampling" not in printed and time.monotonic() < limit:
            printed += os.read(ours, 4096)
        process.send_signal(signal.SIGINT)
        try:
            while part := os.read(ours, 4096):
                printed += part
        except OSError:  # Linux: the other end is closed.
            pass
        assert process.wait(60) == 130
        assert process.stdout is not None and process.stdout.read() == b""
    os.close(ours)
    assert b"interrupted" in printed and b"Traceback" not in printed
    assert not any(tmp_path.iterdir())


def test_workers_do_not_outlive_a_killed_command(tmp_path: Path):
    script = tmp_path / "work.py"
    script.write_text(WORK)
    with subprocess.Popen([sys.executable, script]) as command:
        parent = psutil.Process(command.pid)
        # Two workers, and Python's resource tracker.
        limit = time.monotonic() + 60
        while len(parent.children()) < 3 and time.monotonic() < limit:
            time.sleep(0.05)
        workers = parent.children()
        time.sleep(1)  # so that they have begun
        command.kill()
    _, alive = psutil.wait_procs(workers, timeout=20)
    assert len(workers) == 3 and not alive


def test_a_second_interruption_does_not_disturb_the_first(tmp_path: Path):
    with subprocess.Popen(
        [sys.executable, "-c", SLOW],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as command:
        assert command.stdout is not None and command.stderr is not None
        assert command.stdout.readline() == b"begun\n"
        for _ in range(3):
            command.send_signal(signal.SIGTERM)
            time.sleep(0.2)
        printed = command.stderr.read()
        assert command.wait(30) == 130
    assert printed.strip() == b"hdcal: interrupted"
    assert (tmp_path / "cleaned-up").exists()
