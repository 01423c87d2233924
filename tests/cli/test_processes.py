"""Processes of one command end with it, whatever ends it."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from slices import slice_of

WORK = (
    "import time; from hdcal.cli.processes import run_all\n"
    "if __name__ == '__main__': run_all(time.sleep, [(100,), (100,)], 2)"
)
FAILING = """
import multiprocessing, time
from hdcal.cli.processes import run_all

def fail(text):
    raise ValueError(text)

if __name__ == "__main__":
    own = multiprocessing.get_context("spawn").Process(target=time.sleep, args=(100,))
    own.start()
    try:
        run_all(fail, [("a",), ("b",)], 2)
    except ValueError:
        own.join(2)
        print(own.is_alive(), len(multiprocessing.active_children()))
    own.kill()
"""
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


def test_workers_do_not_outlive_a_killed_command(tmp_path: Path):
    script = tmp_path / "work.py"
    script.write_text(WORK)
    with subprocess.Popen([sys.executable, script]) as command:
        parent = psutil.Process(command.pid)
        # Two workers, and Python's own process that looks after shared things.
        limit = time.monotonic() + 60
        while len(parent.children()) < 3 and time.monotonic() < limit:
            time.sleep(0.05)
        workers = parent.children()
        time.sleep(1)  # so that they have begun
        command.kill()
    _, alive = psutil.wait_procs(workers, timeout=20)
    assert len(workers) == 3 and not alive


def test_work_that_fails_ends_its_workers_and_nobody_else(tmp_path: Path):
    script = tmp_path / "work.py"
    script.write_text(FAILING)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert done.stdout == "True 1\n", done.stderr


@pytest.mark.parametrize(
    "by", slice_of([signal.SIGINT, signal.SIGTERM], [signal.SIGTERM])
)
def test_a_second_interruption_does_not_disturb_the_first(by, tmp_path: Path):
    with subprocess.Popen(
        [sys.executable, "-c", SLOW],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as command:
        assert command.stdout is not None and command.stderr is not None
        assert command.stdout.readline() == b"begun\n"
        for _ in range(3):
            command.send_signal(by)
            time.sleep(0.2)
        said = command.stderr.read()
        assert command.wait(30) == 130
    assert said.strip() == b"hdcal: interrupted: nothing was written"
    assert (tmp_path / "cleaned-up").exists()
