"""What more rows cost: hot sampling, and the memory of a whole calibration."""

import json
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

from benchmarks.children import CASE, HDCAL, ask, run, table

SIZES = (14, 10_000, 1_000_000, 10_000_000)
COLUMNS = "deformation_mm,force_N"


def main(repeats: int) -> None:
    _show_memory()
    found = ask("rows", repeats)
    least = median(found[str(SIZES[0])]["sampling"])
    print()
    table(
        ("rows", "compressing [s]", "sampling [s]", "ratio", "wanted", "least ESS"),
        [
            (
                f"{size:,}".replace(",", " "),
                f"{found[str(size)]['compressing']:.3f}",
                f"{(middle := median(found[str(size)]['sampling'])):.3f}",
                f"{middle / least:.2f}",
                "≤ 1.5" if size > 1e5 else "",
                f"{found[str(size)]['ess']:.0f}",
            )
            for size in SIZES
        ],
    )


def _show_memory() -> None:
    heading = "rows", "first [s]", "warm [s]", "memory [GiB]", "reading alone [s]"
    with tempfile.TemporaryDirectory() as folder:
        table(heading, (_whole(size, Path(folder)) for size in SIZES))


def _whole(size: int, scratch: Path) -> tuple:
    """Return what a whole `hdcal calibrate` takes, and one that only reads."""
    case = (CASE,)
    if size != SIZES[0]:
        run("-m", "benchmarks.made", scratch / "data.csv", size, COLUMNS)
        case = scratch / "data.csv", "--gear", CASE / "gear.toml"
    command = (*HDCAL, "calibrate", *case, "--out", scratch / "out", "--force")
    cache = scratch / str(size)
    first, *warm = [run(*command, HDCAL_CACHE_DIR=cache) for _ in range(3)]
    read = "import sys, hdcal; hdcal.read_case(sys.argv[1], gear=sys.argv[2])"
    gear = CASE / "gear.toml"
    table = case[0] / "data.csv" if size == SIZES[0] else case[0]
    reading = median(run("-c", read, table, gear).seconds for _ in range(2))
    peak = max(one.peak_bytes for one in warm) / 2**30
    seconds = median(one.seconds for one in warm)
    times = f"{first.seconds:.1f}", f"{seconds:.2f}", f"{peak:.2f}"
    return f"{size:,}".replace(",", " "), *times, f"{reading:.2f}"


def measure(repeats: int) -> dict:
    """Sample the same model over and over, sizes in turn; nothing compiles then."""
    import numpy as np

    from benchmarks.density import least_ess
    from benchmarks.made import rows
    from hdcal import read_case
    from hdcal.data.priors import effect_priors
    from hdcal.inference import laplace
    from hdcal.inference.force_model.problem import build_problem
    from hdcal.inference.sample import sample

    small = read_case(CASE)
    gear = replace(small.gear, force_resolution=0.0)
    ready, found = {}, {}
    for size in SIZES:
        made = rows(size)
        fields = {
            name: np.full(size, value[0])
            for name, value in vars(small.records).items()
            if name != "known"
        }
        fields["deformation"], fields["force"] = made["deformation_mm"], made["force_N"]
        records = replace(small.records, **fields)
        began = time.perf_counter()
        case = replace(small, gear=gear, records=records)
        problem = build_problem(case, effect_priors())
        compressing = time.perf_counter() - began
        whitening = laplace.fit(problem)
        draws = sample(problem, whitening, 0)
        ready[size] = problem, whitening
        found[size] = {"compressing": compressing, "sampling": []}
        found[size]["ess"] = least_ess(draws.values)
    for turn in range(1, repeats + 1):
        for size, (problem, whitening) in ready.items():
            began = time.perf_counter()
            sample(problem, whitening, turn)
            found[size]["sampling"].append(time.perf_counter() - began)
    return found


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
