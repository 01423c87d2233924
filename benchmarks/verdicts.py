"""What a diagnosis costs: whole processes, one case after the other, more rows."""

import json
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

from benchmarks.children import CASE, HDCAL, ROOT, ask, run, table

SIZES = (180, 1_800, 18_000, 100_000)
MANY = 200
_CYCLES = ROOT / "datasets" / "thermal-demo"


def main(repeats: int) -> None:
    _show_processes(repeats)
    print()
    hot = ask("verdicts", "many", MANY)
    table(
        ("cases of 180 rows, one process", "seconds", "wanted"),
        [
            ("first, compilation included", f"{hot['first']:.1f}", ""),
            ("one more, median", f"{hot['hot']:.2f}", "≤ 0.25"),
            (f"all {MANY}", f"{hot['all']:.1f}", "≤ 30"),
        ],
    )
    print()
    lines = []
    for size in SIZES:
        child = run("-m", "benchmarks.verdicts", "rows", size)
        found = json.loads(child.output.splitlines()[-1])
        peak = child.peak_bytes / 2**30
        lines.append((size, f"{found['hot']:.2f}", f"{peak:.2f}"))
    table(("rows", "hot [s]", "peak memory [GiB] (≤ 2)"), lines)


def _show_processes(repeats: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        cache, out = Path(folder) / "cache", Path(folder) / "out"
        words = {
            "calibrate": ("`hdcal calibrate`", "calibrate", ()),
            "quick": ("`hdcal diagnose --quick`", "diagnose", ("--quick",)),
            "whole": ("`hdcal diagnose`", "diagnose", ()),
        }
        seconds = {name: [] for name in words}
        for turn in range(repeats + 1):
            for name, (_, command, options) in words.items():
                done = run(
                    *(*HDCAL, command, CASE, "--out", out / name, "--force", *options),
                    HDCAL_CACHE_DIR=cache,
                )
                if turn:
                    seconds[name].append(done.seconds)
    least = median(seconds["calibrate"])
    table(
        ("process, warm", "median [s]", "ratio", "wanted"),
        [
            (
                words[name][0],
                f"{median(taken):.1f}",
                f"{median(taken) / least:.2f}",
                "≤ 3" if name == "whole" else "",
            )
            for name, taken in seconds.items()
        ],
    )


def _cases(size: int, count: int) -> list:
    """Return load/unload cycles with a loop, `count` draws of the noise."""
    import numpy as np

    import hdcal
    from hdcal.evidence.row_features import take_rows

    case = hdcal.read_case(_CYCLES)
    rows = np.arange(size) % len(case.records.force)
    records = take_rows(case.records, rows)
    path = np.linspace(0.0, 12.0 * np.pi, size)
    half = np.where(np.sin(path) >= 0.0, 1.0, -1.0)
    deformation = 0.28 - 0.26 * np.cos(path)
    force = 200.0 * deformation + 0.4 * half
    rng = np.random.default_rng(size)
    made = replace(
        records,
        deformation=deformation,
        sense=half,
        direction=half,
        time=np.arange(size) * 5.0,
        temperature=np.repeat([20.0, 50.0, 35.0], -(-size // 3))[:size],
        run=np.zeros(size, int),
    )
    return [
        replace(
            case,
            records=replace(made, force=force + rng.normal(0.0, 0.4, size)),
        )
        for _ in range(count)
    ]


def measure(what: str, number: int) -> dict:
    import hdcal

    seconds = []
    for case in _cases(number, 3) if what == "rows" else _cases(180, number):
        began = time.perf_counter()
        hdcal.diagnose(case, quick=True)
        seconds.append(time.perf_counter() - began)
    return {"first": seconds[0], "hot": median(seconds[1:]), "all": sum(seconds)}


if __name__ == "__main__":
    print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))))
