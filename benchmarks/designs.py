"""Designs a second: every draw on every design, quantiles of the force included."""

import json
import sys
import time
from dataclasses import replace
from statistics import median

from benchmarks.children import CASE, run, table

DRAWS = 2000
SIZES = {"10⁶ evaluations (500 designs)": 500, "50 × 50 study": 2500}
WANTED = {"10⁶ evaluations (500 designs)": "≤ 1", "50 × 50 study": "≤ 2"}


def main(repeats: int) -> None:
    child = run("-m", "benchmarks.designs", repeats)
    found = json.loads(child.output.splitlines()[-1])
    rows = [
        (size, path, f"{median(times):.4f}", WANTED[size])
        for size, paths in found.items()
        for path, times in paths.items()
    ]
    table((f"{DRAWS} draws", "how", "hot, median [s]", "wanted [s]"), rows)
    print(f"\nPeak memory {child.peak_bytes / 2**30:.2f} GiB, wanted ≤ 2.")


def measure(repeats: int) -> dict:
    """Take turns between the shortcut, the general path and one with an effect."""
    import numpy as np

    from hdcal import read_case
    from hdcal.design.design_draws import design_draws
    from hdcal.design.study.force_quantiles import force_quantiles, general_quantiles
    from hdcal.physics.effects.stiffness import ProgressiveStiffening

    line = design_draws(read_case(CASE).gear, draws=DRAWS)
    random = np.random.default_rng(0)
    slope = {"progressive_stiffening.slope": random.normal(0.35, 0.05, DRAWS)}
    effects = replace(line.problem, effects=(ProgressiveStiffening,))
    bent = replace(line, problem=effects, values={**line.values, **slope})
    paths = {
        "no effects: one gear's quantiles, scaled": (force_quantiles, line),
        "no effects: every draw on every design": (general_quantiles, line),
        "an effect: every draw on every design": (force_quantiles, bent),
    }
    found = {}
    for name, size in SIZES.items():
        factor, at = random.uniform(0.7, 1.4, size), random.uniform(0.3, 0.5, size)
        warm, shares = random.choice([20.0, 60.0], size), np.array([0.025, 0.5, 0.975])
        times = {path: [] for path in paths}
        for turn in range(repeats + 1):
            for path, (quantiles, basis) in paths.items():
                began = time.perf_counter()
                quantiles(basis, factor, at, warm, shares)
                if turn:
                    times[path].append(time.perf_counter() - began)
        found[name] = times
    return found


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
