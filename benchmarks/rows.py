"""What more rows cost: hot sampling, and the memory of a whole calibration."""

import json
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

from benchmarks.children import CASE, HDCAL, ask, run, table

SIZES = (14, 10_000, 1_000_000)
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
                "≤ 1.5" if size == SIZES[-1] else "",
                f"{found[str(size)]['ess']:.0f}",
            )
            for size in SIZES
        ],
    )


def _show_memory() -> None:
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        run("-m", "benchmarks.made", scratch / "data.csv", SIZES[-1], COLUMNS)
        whole = ("--out", scratch / "out", "--force")
        cases = {
            "`hdcal calibrate`, 14 rows": (CASE,),
            "`hdcal calibrate`, 10⁶ rows": (
                scratch / "data.csv",
                "--gear",
                CASE / "gear.toml",
            ),
        }
        for words, case in cases.items():
            # Twice: the first run compiles and needs more of both.
            for state in ("empty", "filled"):
                cache = scratch / "cache"
                child = run(*HDCAL, "calibrate", *case, *whole, HDCAL_CACHE_DIR=cache)
                peak = child.peak_bytes / 2**30
                lines.append((words, state, f"{child.seconds:.1f}", f"{peak:.2f}"))
    heading = ("process", "compilation cache", "time [s]", "peak memory [GiB] (≤ 2)")
    table(heading, lines)


def measure(repeats: int) -> dict:
    """Sample the same model over and over, sizes in turn; nothing compiles then."""
    import jax

    from benchmarks.density import least_ess
    from benchmarks.made import rows
    from hdcal import read_case
    from hdcal.data.priors import effect_priors
    from hdcal.inference import laplace
    from hdcal.inference.problem import build_problem
    from hdcal.inference.sample import sample

    small = read_case(CASE)
    gear, key = replace(small.gear, force_resolution=0.0), jax.random.key(0)
    ready, found = {}, {}
    for size in SIZES:
        made = rows(size)
        fields = {
            name: [value[0]] * size
            for name, value in vars(small.records).items()
            if name != "known"
        }
        fields["deformation"], fields["force"] = made["deformation_mm"], made["force_N"]
        records = replace(small.records, **_arrays(fields))
        began = time.perf_counter()
        case = replace(small, gear=gear, records=records)
        problem = build_problem(case, effect_priors())
        compressing = time.perf_counter() - began
        whitening = laplace.fit(problem)
        draws = sample(problem, whitening, key)
        ready[size] = problem, whitening
        found[size] = {"compressing": compressing, "sampling": []}
        found[size]["ess"] = least_ess(draws.values)
    for turn in range(1, repeats + 1):
        for size, (problem, whitening) in ready.items():
            began = time.perf_counter()
            sample(problem, whitening, jax.random.key(turn))
            found[size]["sampling"].append(time.perf_counter() - began)
    return found


def _arrays(fields: dict) -> dict:
    import numpy as np

    return {name: np.asarray(values) for name, values in fields.items()}


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
