"""Processor time and memory of each command, of one installation of hdcal or several.

    python -m benchmarks.commands [hdcal …] [--repeats 3]

Each program is given by its path; they run in turn, each with a compilation cache of
its own that a first round has filled. Options are those that version 0.1 has too.
"""

import argparse
import os
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

from benchmarks.children import ROOT, table

DATA = ROOT / "datasets"
TRACKED = 2_000
COMMANDS = {
    "check": "check {data}/xb1-100-80",
    "fit": "fit {data}/xb1-100-80",
    "calibrate": "calibrate {data}/xb1-100-80 --out {own}/calibrate --force",
    "calibrate, with a leftover": "calibrate {data}/xb1-100-80 --with-gap "
    "--out {own}/gap --force",
    "calibrate, moving": "calibrate {data}/ring-down-demo --dynamic "
    "--out {own}/moving --force",
    "diagnose --quick": "diagnose {data}/xb1-100-80 --quick --out {own}/quick --force",
    "predict": "predict {own}/calibrate --deformation 0.2,0.4",
    "margin": "margin {own}/calibrate --deformation 0.4 --limit-force 90 "
    "--out {own}/margin --force",
    "margin of a load, two temperatures": "margin {own}/calibrate --deformation 0.4 "
    "--temperature 20,40 --quantity load",
    "design": "design {own}/calibrate --window 0.38:0.42 --out {own}/design --force",
    "study": "study {own}/calibrate --vary wall_thickness_mm=0.6:0.76:5 "
    "--out {own}/study --force",
    "respond": "respond {own}/calibrate --force step --amplitude 40 --duration 0.02 "
    "--out {own}/respond --replace",
    f"track, {TRACKED} readings": "track {own}/calibrate",
}


def readings(count: int) -> str:
    """Return lines of readings of an ordinary gear."""
    return "".join(
        f'{{"deformation_mm": {x:.4f}, "force_N": {208.0 * x - 1.0 + wobble:.3f}}}\n'
        for i in range(count)
        for x, wobble in [(0.05 + 0.45 * (i % 97) / 97, 0.8 * ((i * 31) % 17 - 8) / 8)]
    )


def spent(program: str, command: str, own: Path) -> tuple[float, float]:
    """Return processor time [s] and peak memory [MiB] of a command.

    Args:
        program: path of hdcal.
        command: its arguments.
        own: folder of this program's results and its cache.
    """
    asked = command.format(data=DATA, own=own).split()
    settings = os.environ | {"HDCAL_CACHE_DIR": str(own / "cache")}
    lines = own / "readings.jsonl"
    lines.write_text(readings(TRACKED), "utf-8")
    with (
        lines.open() as given,
        subprocess.Popen(
            [program, *asked],
            env=settings,
            stdin=given,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        ) as child,
    ):
        said = child.stderr.read().decode()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise RuntimeError(f"{program} {' '.join(asked)}: {said.strip()}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0


def compare(
    programs: Sequence[str], repeats: int, scratch: Path
) -> Iterator[list[str]]:
    """Yield a row for each command."""
    folders = [scratch / str(index) for index in range(len(programs))]
    for folder in folders:
        folder.mkdir()
    for name, command in COMMANDS.items():
        found = [[] for _ in programs]
        # The first round compiles.
        for turn in range(repeats + 1):
            for each, program, own in zip(found, programs, folders, strict=True):
                one = spent(program, command, own)
                if turn:
                    each.append(one)
        middle = [map(median, zip(*each, strict=True)) for each in found]
        yield [name, *(f"{s:.1f} s, {m:.0f} MiB" for s, m in middle)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*", default=["hdcal"])
    parser.add_argument("--repeats", type=int, default=3)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = compare(asked.programs, asked.repeats, Path(folder))
        table(("command", *asked.programs), rows)


if __name__ == "__main__":
    main()
