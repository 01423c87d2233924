"""Designs a second: every draw on every design, quantiles of the force included."""

import json
import sys
import time
from statistics import median

from benchmarks.children import CASE, run, table

DRAWS = 2000
SIZES = {"10⁶ evaluations (500 designs)": 500, "50 × 50 study": 2500}
WANTED = {"10⁶ evaluations (500 designs)": "≤ 1", "50 × 50 study": "≤ 2"}


def main(repeats: int) -> None:
    child = run("-m", "benchmarks.designs", repeats)
    found = json.loads(child.output.splitlines()[-1])
    rows = [
        (size, f"{median(times):.4f}", WANTED[size]) for size, times in found.items()
    ]
    table((f"{DRAWS} draws", "hot, median [s]", "wanted [s]"), rows)
    print(f"\nPeak memory {child.peak_bytes / 2**30:.2f} GiB, wanted ≤ 2.")


def measure(repeats: int) -> dict:
    """Return the seconds of each turn by the number of designs."""
    import numpy as np

    from hdcal import calibrate, read_case
    from hdcal.design.gears import calibrated_gears
    from hdcal.design.study import force_quantiles

    gears = calibrated_gears(calibrate(read_case(CASE), draws=DRAWS // 4))
    random = np.random.default_rng(0)
    found = {}
    for name, size in SIZES.items():
        factor, at = random.uniform(0.7, 1.4, size), random.uniform(0.3, 0.5, size)
        warm, shares = random.choice([20.0, 60.0], size), np.array([0.025, 0.5, 0.975])
        found[name] = []
        for turn in range(repeats + 1):
            began = time.perf_counter()
            force_quantiles(gears, at, warm, factor, shares)
            if turn:
                found[name].append(time.perf_counter() - began)
    return found


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
