"""Rows per second of `read_case` on a CSV file of a million rows."""

import json
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from benchmarks.children import CASE, ask, run, table

SIZE = 1_000_000
FILES = ("deformation_mm,force_N", "time_s,temperature_C,deformation_mm,force_N")


def main(repeats: int) -> None:
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "data.csv"
        for names in FILES:
            run("-m", "benchmarks.made", path, SIZE, names)
            seconds = ask("reading", path, repeats)["seconds"]
            fast = SIZE / median(seconds)
            columns = names.replace(",", ", ")
            found.append((columns, f"{median(seconds):.2f}", f"{fast:.1e}", "≥ 2e5"))
    table(("columns", "median [s]", "rows per second", "wanted"), found)


def measure(path: Path, repeats: int) -> dict:
    """Read the file over and over; what importing takes is not counted."""
    from hdcal import read_case

    read_case(CASE)
    seconds = []
    for _ in range(repeats):
        began = time.perf_counter()
        case = read_case(path, CASE / "gear.toml")
        seconds.append(time.perf_counter() - began)
    if len(case.records.force) != SIZE:
        raise RuntimeError("not every row was read")
    return {"seconds": seconds}


if __name__ == "__main__":
    print(json.dumps(measure(Path(sys.argv[1]), int(sys.argv[2]))))
