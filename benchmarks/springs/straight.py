"""Plain straight files: hdcal beside least squares with a free intercept."""

import argparse

import numpy as np
from scipy import stats

import hdcal

GEAR = {
    "name": "spring",
    "theory": "spring",
    "deformation": "radial",
    "reference_temperature_C": 20.0,
}
# Of the width of the interval of least squares.
ALLOWED = 0.02


def plain_record(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return deformation [mm] and force [N] of a straight record of any scale."""
    rows = int(np.exp(rng.uniform(np.log(15), np.log(4000))))
    slope, span = 10 ** rng.uniform(-2.0, 6.0), 10 ** rng.uniform(-1.5, 1.5)
    origin = rng.choice([-1.0, 0.0, 1.0]) * 10 ** rng.uniform(-1.0, 2.0) * span
    offset = rng.choice([0.0, 1.0]) * rng.normal(0.0, 3.0) * slope * span
    noise = 10 ** rng.uniform(-3.5, -1.0) * slope * span
    way = np.linspace(0.0, span, rows)
    return origin + way, offset + slope * way + rng.normal(0.0, noise, rows)


def beside_least_squares(x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    """Return differences of median, sd and width from least squares, in widths."""
    found = hdcal.calibrate(
        hdcal.read_case({"deformation_mm": x, "force_N": y}, gear=GEAR), seed=seed
    )
    if not found.usable:
        return np.full(3, np.inf)
    draws = np.asarray(found.draws["stiffness"]).ravel()
    line, free = stats.linregress(x, y), len(x) - 2
    low, high = np.quantile(draws, [0.025, 0.975])
    width = 2.0 * stats.t.ppf(0.975, free) * line.stderr
    sd_of_line = line.stderr * np.sqrt(free / (free - 2))
    differences = [np.median(draws) - line.slope, np.std(draws) - sd_of_line]
    return np.array([*differences, (high - low) - width]) / width


def main() -> None:
    """Print how often both agree."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    found = np.array(
        [beside_least_squares(*plain_record(rng), i) for i in range(given.count)]
    )
    for name, column in zip(("stiffness", "sd", "width"), np.abs(found).T, strict=True):
        print(
            f"{name}: {np.mean(column < ALLOWED):.1%} within {ALLOWED:.0%} of the "
            f"interval's width; median {np.median(column):.2%}, most {column.max():.1%}"
        )


if __name__ == "__main__":
    main()
