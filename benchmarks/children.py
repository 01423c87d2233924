"""Processes of their own to measure in, and a table of what they said."""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CASE = ROOT / "datasets" / "xb1-100-80"
# In hdcal's own words, without the console script's own start.
HDCAL = ("-m", "hdcal")


@dataclass(frozen=True)
class Run:
    seconds: float
    peak_bytes: int
    output: str


def run(*arguments, program=(sys.executable,), stdin=None, **environment) -> Run:
    """Run this Python, or another program; what goes wrong there goes wrong here."""
    command = [*program, *map(str, arguments)]
    settings = os.environ | {name: str(v) for name, v in environment.items()}
    began = time.perf_counter()
    with subprocess.Popen(
        command,
        env=settings,
        cwd=ROOT,
        text=True,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as child:
        output = child.stdout.read()
        _, status, usage = os.wait4(child.pid, 0)
        seconds = time.perf_counter() - began
        child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise subprocess.CalledProcessError(child.returncode, command, output)
    # Kibibytes, but bytes on macOS.
    unit = 1 if sys.platform == "darwin" else 1024
    return Run(seconds, usage.ru_maxrss * unit, output)


def ask(module: str, *arguments, **environment) -> dict:
    """Run a module of this package as a child; return what it says in JSON."""
    output = run("-m", f"benchmarks.{module}", *arguments, **environment).output
    return json.loads(output.splitlines()[-1])


def table(heading: tuple[str, ...], rows) -> None:
    """Print a Markdown table."""
    # Each as soon as it is measured.
    for row in chain((heading, ["---"] * len(heading)), rows):
        print("|", " | ".join(map(str, row)), "|", flush=True)
