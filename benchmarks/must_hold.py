"""Whether what is promised at 95 % holds, on rigs whose truth is known.

    python -m benchmarks.must_hold --count 200 --seed 1 [ROW …]

Each row of the table is a way in which everyday rigs break assumptions. The file uses
only what version 0.1 has too, so that it runs with either: once more by its path, with
the other version on the path of Python.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import stats

import hdcal

SLOPE, ZERO, REFERENCE = 205.0, -1.0, 20.0
AT, CONTENT, STEP = 0.4, 0.99, 0.98
# Noise below a third of a step [N].
FINE = 0.3
GEAR = """
[gear]
wall_thickness_mm = 0.68
radius_mm = 40.0
length_mm = 70.0
material = "40CrNiMoA"

[measurement]
reference_temperature_C = 20.0
"""


class Outcome(NamedTuple):
    """What one simulated rig gave.

    Attributes:
        holds: whether the promise holds; None where the calibration failed.
        warned: whether the answer says that something is out of the ordinary.
        width: of the interval, or how far the bound lies above the truth.
    """

    holds: bool | None
    warned: bool
    width: float


def case_of(deformation, force, folder: Path, step: float = 0.0):
    """Return readings as hdcal reads them from files."""
    gear = GEAR + (f"force_resolution_N = {step}\n" if step else "")
    (folder / "gear.toml").write_text(gear, "utf-8")
    table = np.column_stack([deformation, force])
    head = "deformation_mm,force_N"
    np.savetxt(folder / "data.csv", table, "%.9g", ",", header=head, comments="")
    return hdcal.read_case(folder)


def ramp(rows: int) -> np.ndarray:
    """Return deformations of one ramp [mm]."""
    return np.linspace(0.02, 0.54, rows)


def autoregression(rows: int, correlation: float, rng) -> np.ndarray:
    """Return noise of sd 1 whose neighbours are correlated."""
    found = rng.normal(size=rows)
    for row in range(1, rows):
        new = np.sqrt(1.0 - correlation**2) * found[row]
        found[row] = correlation * found[row - 1] + new
    return found


def warned(posterior) -> bool:
    """Tell whether the reader of a calibration is told of anything unusual."""
    checks = any(check.outcome == "warning" for check in posterior.checks)
    left = hdcal.residuals(posterior)
    return checks or bool(left.structure) or bool(getattr(left, "noise", ()))


def inside(posterior, name: str, truth: float) -> Outcome:
    """Return whether a parameter's 95 % interval holds the truth."""
    if not posterior.usable:
        return Outcome(None, True, np.nan)
    low, high = np.quantile(posterior.draws[name], [0.025, 0.975])
    return Outcome(bool(low <= truth <= high), warned(posterior), float(high - low))


def stiffness(rows: int, correlation: float, sd: float = 0.6):
    """Return a row: the interval of the stiffness under correlated noise."""

    def one(rng, folder: Path, seed: int) -> Outcome:
        x = ramp(rows)
        force = SLOPE * x + ZERO + sd * autoregression(rows, correlation, rng)
        found = hdcal.calibrate(case_of(x, force, folder), seed=seed)
        return inside(found, "stiffness", SLOPE)

    return one


def loud(rng, folder: Path, seed: int) -> Outcome:
    """Noise of a fifth of full scale: the interval of σ."""
    x, sd = ramp(60), 0.2 * SLOPE * 0.54
    force = SLOPE * x + ZERO + rng.normal(0.0, sd, 60)
    found = hdcal.calibrate(case_of(x, force, folder), seed=seed)
    return inside(found, "sigma", sd)


def _bound(
    posterior, at: float, mean: float, share: Callable[[float], float]
) -> Outcome:
    """Return whether the upper 99/95 bound of readings holds what it promises."""
    if not posterior.usable:
        return Outcome(None, True, np.nan)
    found = hdcal.margin(posterior, at, content=CONTENT)
    upper = found.worst.upper_bound_N
    return Outcome(share(upper) >= CONTENT, warned(posterior), upper - mean)


def proportional(rng, folder: Path, seed: int) -> Outcome:
    """Noise in proportion to the force: the upper bound of readings."""
    x, mean = ramp(60), SLOPE * AT + ZERO
    force = (SLOPE * x + ZERO) * (1.0 + 0.2 * rng.normal(size=60))
    found = hdcal.calibrate(case_of(x, force, folder), seed=seed)
    return _bound(
        found, AT, mean, lambda upper: stats.norm.cdf(upper, mean, 0.2 * mean)
    )


def _rounded(rng, folder: Path, seed: int):
    """Return a calibration to steps three times the noise, and a place to ask at.

    The place lies anywhere between two steps: how many readings lie above a bound
    hangs on that.
    """
    x, at = ramp(500), rng.uniform(0.2, 0.5)
    exact = SLOPE * x + ZERO + rng.normal(0.0, FINE, 500)
    case = case_of(x, STEP * np.round(exact / STEP), folder, STEP)
    return hdcal.calibrate(case, seed=seed), at, SLOPE * at + ZERO


def rounded(rng, folder: Path, seed: int) -> Outcome:
    """Steps three times the noise, many rows: the upper bound of readings."""
    found, at, mean = _rounded(rng, folder, seed)

    def share(upper: float) -> float:
        edge = (np.floor(upper / STEP) + 0.5) * STEP
        return float(stats.norm.cdf(edge, mean, FINE))

    return _bound(found, at, mean, share)


def rounded_exceedance(rng, folder: Path, seed: int) -> Outcome:
    """The same steps: the interval of the probability that a capacity is exceeded."""
    found, at, mean = _rounded(rng, folder, seed)
    capacity = mean + FINE * rng.uniform(0.5, 2.5)
    edge = (np.floor(capacity / STEP) + 0.5) * STEP
    truth = float(stats.norm.sf(edge, mean, FINE))
    if not found.usable:
        return Outcome(None, True, np.nan)
    asked = {"limit_force": capacity}
    given = hdcal.margin(found, at, **asked).worst.exceedance
    holds = given.lo <= truth <= given.hi
    return Outcome(holds, warned(found), given.hi - given.lo)


def few_steps(rng, folder: Path, seed: int) -> Outcome:
    """14 rows in steps of 0.98 N: the interval of the stiffness."""
    x, sd = ramp(14), rng.choice([0.1, 0.3, 0.6])
    force = STEP * np.round((SLOPE * x + ZERO + rng.normal(0.0, sd, 14)) / STEP)
    found = hdcal.calibrate(case_of(x, force, folder, STEP), seed=seed)
    return inside(found, "stiffness", SLOPE)


def slack(rng, folder: Path, seed: int) -> Outcome:
    """Slack in the data and in the model: the interval of the stiffness."""
    x, size = np.concatenate([ramp(20), ramp(20)[::-1]]), rng.choice([0.02, 0.04, 0.08])
    force = SLOPE * np.maximum(x - size, 0.0) + ZERO + rng.normal(0.0, 0.3, 40)
    case = case_of(x, force, folder)
    found = hdcal.calibrate(case, effects=["seating_slack"], seed=seed)
    return inside(found, "stiffness", SLOPE)


ROWS = {
    **{f"independent, {n} rows": stiffness(n, 0.0) for n in (6, 14, 500)},
    "neighbours correlated by 0.3, 60 rows": stiffness(60, 0.3),
    "neighbours correlated by 0.6, 60 rows": stiffness(60, 0.6),
    "noise 20 % of full scale": loud,
    "noise 20 % of the force": proportional,
    "steps of 0.98 N over a noise of 0.3 N, 500 rows": rounded,
    "the same steps: P of more than a capacity": rounded_exceedance,
    "steps of 0.98 N, 14 rows": few_steps,
    "slack on slack": slack,
}


def outcomes(row: str, count: int, seed: int) -> Iterator[Outcome]:
    """Yield what simulated rigs gave, each with a seed of its own."""
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        with tempfile.TemporaryDirectory() as folder:
            yield ROWS[row](rng, Path(folder), index)


def line(row: str, found: list[Outcome], seconds: float) -> str:
    """Return one line of the table."""
    held = [one.holds for one in found if one.holds is not None]
    low, high = stats.binomtest(sum(held), max(len(held), 1)).proportion_ci()
    told = np.mean([one.warned for one in found if one.holds is not None] or [0.0])
    width = np.nanmedian([one.width for one in found])
    share = f"{np.mean(held or [0.0]):.1%} ({low:.0%} … {high:.0%})"
    failed = len(found) - len(held)
    return f"| {row} | {share} | {told:.0%} | {width:.3g} | {failed} | {seconds:.1f} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", nargs="*", help="first letters of rows; all by default")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    print("| simulated rigs | promise holds | warned | width | failed | s each |")
    print("|---|---|---|---|---|---|")
    for row in ROWS:
        if asked.rows and not any(row.startswith(start) for start in asked.rows):
            continue
        began = time.perf_counter()
        found = list(outcomes(row, asked.count, asked.seed))
        each = (time.perf_counter() - began) / asked.count
        print(line(row, found, each), flush=True)


if __name__ == "__main__":
    main()
