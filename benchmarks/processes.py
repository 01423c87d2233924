"""Seconds of each command, as ratios to importing the libraries of a calibration.

    python -m benchmarks.processes [OTHER/bin/hdcal …] [--repeats 5]

Whole processes, here with the Python that runs this, elsewhere by the path of another
installation's program. They run in turn, after a round that fills the compilation cache
of each: a busy machine slows all of them. Options are those that version 0.1 has too.
"""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

from benchmarks.children import HDCAL, ROOT, Run, run, table

DATA = ROOT / "datasets"
TRACKED = 2_000
IMPORTS = (
    "jax equinox numpyro scipy.stats xarray h5netcdf arviz_stats pandas "
    "matplotlib.pyplot pydantic jinja2 rich.console"
)
# Arguments, and the ratio that is wanted.
COMMANDS = {
    "`--help`": ("--help", 0.05),
    "check": ("check {data}/xb1-100-80", None),
    "fit": ("fit {data}/xb1-100-80", None),
    "calibrate": ("calibrate {data}/xb1-100-80 --out {own}/calibrate --force", 2.0),
    "calibrate, nothing compiled": (
        "calibrate {data}/xb1-100-80 --out {own}/first --force",
        None,
    ),
    "calibrate, with a discrepancy": (
        "calibrate {data}/xb1-100-80 --with-gap --out {own}/gap --force",
        None,
    ),
    "calibrate, moving": (
        "calibrate {data}/ring-down-demo --dynamic --out {own}/moving --force",
        None,
    ),
    "predict": ("predict {own}/calibrate --deformation 0.2,0.4", None),
    "margin": ("margin {own}/calibrate --deformation 0.4 --limit-force 90", 1.3),
    "margin, a folder": (
        "margin {own}/calibrate --deformation 0.4 --limit-force 90 "
        "--out {own}/margin --force",
        None,
    ),
    "margin of a load, two temperatures": (
        "margin {own}/calibrate --deformation 0.4 --temperature 20,40 --quantity load",
        None,
    ),
    "diagnose --quick": (
        "diagnose {data}/xb1-100-80 --quick --out {own}/quick --force",
        2.2,
    ),
    "diagnose": ("diagnose {data}/xb1-100-80 --out {own}/diagnose --force", None),
    "design": (
        "design {own}/calibrate --window 0.38:0.42 --out {own}/design --force",
        None,
    ),
    "study": (
        "study {own}/calibrate --vary wall_thickness_mm=0.6:0.76:5 "
        "--out {own}/study --force",
        None,
    ),
    "respond": (
        "respond {own}/calibrate --force step --amplitude 40 --duration 0.02 "
        "--out {own}/respond --replace",
        None,
    ),
    f"track, {TRACKED} readings": ("track {own}/calibrate", None),
}
# Compiling is long and steady: twice will do.
COLD, COLD_RUNS = "calibrate, nothing compiled", 2


def readings(count: int) -> str:
    """Return lines of readings of an ordinary gear."""
    return "".join(
        f'{{"deformation_mm": {x:.4f}, "force_N": {208.0 * x - 1.0 + wobble:.3f}}}\n'
        for i in range(count)
        for x, wobble in [(0.05 + 0.45 * (i % 97) / 97, 0.8 * ((i * 31) % 17 - 8) / 8)]
    )


def spent(program: Sequence[str], arguments: str, own: Path, cache: Path) -> Run:
    """Return what a command costs.

    Args:
        program: what starts hdcal.
        arguments: of the command.
        own: folder of this program's results.
        cache: of what it compiles.
    """
    asked = arguments.format(data=DATA, own=own).split()
    with (own / "readings.jsonl").open() as given:
        return run(*asked, program=program, stdin=given, HDCAL_CACHE_DIR=cache)


def main(repeats: int, *others: str) -> None:
    """Print the table."""
    programs = [(sys.executable, *HDCAL), *((other,) for other in others)]
    with tempfile.TemporaryDirectory() as folder:
        folders = [Path(folder) / str(index) for index in range(len(programs))]
        for own in folders:
            own.mkdir()
            (own / "readings.jsonl").write_text(readings(TRACKED), "utf-8")
        heading = ("command", "wanted", "hdcal", *others)
        table(heading, compare(programs, folders, repeats))


def compare(programs: Sequence, folders: Sequence[Path], repeats: int) -> Iterator:
    """Yield a row for each command: its ratio, time and peak memory by each program."""
    names = "; ".join(f"import {name}" for name in IMPORTS.split())
    run("-c", names)
    yield f"import of {IMPORTS.replace(' ', ', ')}", "", *_said([[run("-c", names)]])
    for name, (arguments, wanted) in COMMANDS.items():
        found: list[list[Run]] = [[] for _ in programs]
        imports = []
        for turn in range(1 + min(repeats, COLD_RUNS if name == COLD else repeats)):
            imports.append(run("-c", names).seconds)
            for each, program, own in zip(found, programs, folders, strict=True):
                cache = own / f"cold-{turn}" if name == COLD else own / "cache"
                each.append(spent(program, arguments, own, cache))
        # The first round compiles.
        said = _said([each[1:] for each in found], median(imports[1:]))
        yield name, "" if wanted is None else f"≤ {wanted:g}", *said


def _said(found: Sequence[Sequence[Run]], imported: float | None = None) -> list[str]:
    words = []
    for each in found:
        seconds = median(one.seconds for one in each)
        memory = median(one.peak_bytes for one in each) / 2**20
        ratio = "" if imported is None else f"**{seconds / imported:.2f}**, "
        words.append(f"{ratio}{seconds:.2f} s, {memory:.0f} MiB")
    return words


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("others", nargs="*", metavar="PROGRAM")
    parser.add_argument("--repeats", type=int, default=5)
    asked = parser.parse_args()
    main(asked.repeats, *asked.others)
