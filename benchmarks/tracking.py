"""Rows per second of `hdcal track`, JSON in and out and flushed, one core."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from benchmarks.children import CASE, HDCAL, run, table

ROWS = 50_000
# What any program has to do: read, parse, print, flush.
ECHO = (
    "import json, sys\n"
    "for line in sys.stdin.buffer:\n"
    "    sys.stdout.write(json.dumps(json.loads(line)) + '\\n')\n"
    "    sys.stdout.flush()\n"
)


def main(repeats: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        many, none = Path(folder) / "many.jsonl", Path(folder) / "none.jsonl"
        result = Path(folder) / "result"
        run(*HDCAL, "calibrate", CASE, "--out", result)
        _write(many)
        none.touch()
        commands = {
            "parse and print only": ["-c", ECHO],
            "hdcal track": [*HDCAL, "track", str(result)],
        }
        # In turn, so that a busy machine slows both.
        spent = {name: [] for name in commands}
        for _ in range(repeats):
            for name, command in commands.items():
                spent[name].append(_seconds(command, many) - _seconds(command, none))
    found = []
    for name, seconds in spent.items():
        ratio = median(seconds) / median(spent["parse and print only"])
        rate = f"{ROWS / median(seconds):.1e}"
        wanted = "≥ 5e3 rows/s" if name == "hdcal track" else ""
        found.append((name, rate, f"{ratio:.2f}", wanted))
    table(("process", "rows per second", "time ratio", "wanted"), found)


def _write(path: Path) -> None:
    rng = np.random.default_rng(0)
    deformation = rng.uniform(0.0, 0.54, ROWS)
    force = 209.0 * deformation - 4.0 + rng.normal(0.0, 0.8, ROWS)
    with path.open("w") as file:
        for w, reading in zip(deformation.tolist(), force.tolist(), strict=True):
            line = {"deformation_mm": w, "force_N": reading, "temperature_C": 20.0}
            file.write(json.dumps(line) + "\n")


def _seconds(command: list[str], rows: Path) -> float:
    began = time.perf_counter()
    with rows.open("rb") as lines:
        process = [sys.executable, *command]
        reader = subprocess.Popen(
            ["cat"], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL
        )
        subprocess.run(
            process,
            stdin=lines,
            stdout=reader.stdin,
            stderr=subprocess.DEVNULL,
            check=True,
        )
        reader.communicate()
    return time.perf_counter() - began
