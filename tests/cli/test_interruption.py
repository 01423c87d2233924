"""Ctrl-C in the middle of sampling leaves nothing behind."""

import os
import pty
import signal
import subprocess
import time
from pathlib import Path

import pytest
from commands import MAIN, XB1
from short import SHORT, options
from slices import slice_of


@pytest.mark.parametrize(
    "by", slice_of([signal.SIGINT, signal.SIGTERM], [signal.SIGINT])
)
def test_an_interrupted_run_leaves_nothing(by: signal.Signals, tmp_path: Path):
    # On a terminal the progress bar tells when sampling has begun.
    ours, theirs = pty.openpty()
    endless = options(SHORT | {"draws": 1_000_000})
    command = [*MAIN, "calibrate", str(XB1), *endless]
    with subprocess.Popen(
        command, cwd=tmp_path, stderr=theirs, stdout=subprocess.PIPE
    ) as process:
        os.close(theirs)
        said = b""
        limit = time.monotonic() + 200
        while b"sampling" not in said and time.monotonic() < limit:
            said += os.read(ours, 4096)
        process.send_signal(by)
        try:
            while part := os.read(ours, 4096):
                said += part
        except OSError:  # how Linux says that the other end is closed
            pass
        assert process.wait(60) == 130
        assert process.stdout is not None and process.stdout.read() == b""
    os.close(ours)
    assert b"interrupted" in said and b"Traceback" not in said
    assert not any(tmp_path.iterdir())
