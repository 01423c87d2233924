"""Calibrate simulated springs by a command, and grade its answers.

References: least squares over all rows of each file, over the rows that this version's
screening keeps, and over the longest straight part that it finds.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.springs.record import ALL, faulty_spring, write_csv
from benchmarks.springs.spring import Spring
from hdcal.screening.screen import screen

# An answer that is off by more is wrong.
WRONG = 0.10
GRADES = ("right", "wrong", "no answer exists", "asked", "failed", "crash")
NORMAL = 1.96


@dataclass(frozen=True)
class Answer:
    """An answer to one file: its grade, and the stiffness with its interval."""

    grade: str
    middle: float = np.nan
    low: float = np.nan
    high: float = np.nan

    def holds(self, truth: float) -> bool:
        """Tell whether the interval holds the truth."""
        return self.low <= truth <= self.high


def graded(spring: Spring, middle: float, low: float, high: float) -> Answer:
    """Return an answer with status ok under its grade."""
    if spring.truth is None:
        return Answer("no answer exists", middle, low, high)
    off = abs(middle / spring.truth - 1.0)
    return Answer("right" if off <= WRONG else "wrong", middle, low, high)


def _line(spring: Spring, x: np.ndarray, y: np.ndarray) -> Answer:
    """Return the straight line through some rows of a spring."""
    (slope, _), cov = np.polyfit(x, y, 1, cov=True)
    half = NORMAL * float(np.sqrt(cov[0, 0]))
    return graded(spring, slope, slope - half, slope + half)


def least_squares(spring: Spring) -> Answer:
    """Return the straight line through all rows."""
    return _line(spring, spring.deformation, spring.force)


def least_squares_of_kept(spring: Spring) -> Answer:
    """Return the straight line through the rows that the screening keeps."""
    found = screen(spring.deformation, spring.force)
    if found.asked:
        return Answer("asked")
    return _line(spring, found.deformation[found.kept], found.force[found.kept])


def straight_part(spring: Spring) -> Answer:
    """Return the slope of the longest straight part."""
    found = screen(spring.deformation, spring.force)
    if found.asked:
        return Answer("asked")
    if found.straight is None:
        return Answer("failed")
    slope, half = found.straight.slope, NORMAL * found.straight.slope_sd
    return graded(spring, slope, slope - half, slope + half)


def calibrated(spring: Spring, file: Path, command: list[str]) -> Answer:
    """Return the answer of `hdcal calibrate --json`."""
    out = file.with_suffix("")
    whole = [*command, "calibrate", str(file), "--out", str(out), "--json"]
    run = subprocess.run(whole, capture_output=True, text=True)
    if run.returncode == 2:
        return Answer("asked")
    try:
        found = json.loads(run.stdout)
    except ValueError:
        return Answer("crash")
    if run.returncode or found["status"] != "ok":
        return Answer("failed" if run.returncode == 1 else "crash")
    stiffness = found["stiffness_N_per_mm"]
    return graded(spring, *(stiffness[name] for name in ("median", "lo", "hi")))


def table(title: str, springs: list[Spring], answers: list[Answer]) -> None:
    """Print the grades, all in all and by fault."""
    known = [
        answer.holds(spring.truth)
        for spring, answer in zip(springs, answers, strict=True)
        if answer.grade in ("right", "wrong") and spring.truth is not None
    ]
    exists = sum(spring.truth is not None for spring in springs)
    right = sum(answer.grade == "right" for answer in answers)
    print(f"\n### {title}\n")
    print(f"right: {right} of {exists} that have an answer ({right / exists:.0%});")
    print(f"95 % intervals hold {np.mean(known):.1%} of {len(known)} answers\n")
    print("| faults | files | " + " | ".join(GRADES) + " |")
    print("|---" * (len(GRADES) + 2) + "|")
    rows = {"all": springs, "none": [s for s in springs if not s.faults]}
    rows |= {name: [s for s in springs if name in s.faults] for name in ALL}
    of = {id(spring): answer for spring, answer in zip(springs, answers, strict=True)}
    for name, some in rows.items():
        count = Counter(of[id(spring)].grade for spring in some)
        cells = " | ".join(str(count[grade]) for grade in GRADES)
        print(f"| {name} | {len(some)} | {cells} |", flush=True)


def main() -> None:
    """Simulate, calibrate, grade and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.springs")
    parser.description = __doc__
    parser.add_argument("--count", type=int, default=300, help="springs")
    parser.add_argument("--seed", type=int, default=1, help="fresh springs for each")
    parser.add_argument("--hdcal", metavar="PATH", help="another version's command")
    parser.add_argument("--no-hdcal", action="store_true", help="references only")
    parser.add_argument("--keep", metavar="DIR", help="keep the files there")
    given = parser.parse_args()
    command = [given.hdcal] if given.hdcal else [sys.executable, "-m", "hdcal"]
    rng = np.random.default_rng(given.seed)
    springs = [faulty_spring(rng) for _ in range(given.count)]
    clocks = rng.random(given.count) < 0.7
    answers, lines = [], []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(given.keep or temporary)
        folder.mkdir(exist_ok=True, parents=True)
        for place, spring in enumerate(springs):
            file = folder / f"spring{place}.csv"
            write_csv(spring, file, bool(clocks[place]))
            if given.no_hdcal:
                answers.append(Answer("failed"))
            else:
                answers.append(calibrated(spring, file, command))
            lines.append(least_squares(spring))
            truth = "none" if spring.truth is None else f"{spring.truth:.4g}"
            faults = {name: round(size, 3) for name, size in spring.faults.items()}
            one = answers[-1]
            print(
                f"{place} {spring.rows} rows, {truth} N/mm, {one.grade}: "
                f"{one.middle:.4g} ({one.low:.4g} … {one.high:.4g}), "
                f"least squares {lines[-1].middle:.4g}, {faults}",
                file=sys.stderr,
                flush=True,
            )
    table("hdcal", springs, answers)
    table("least squares over all rows", springs, lines)
    kept = [least_squares_of_kept(spring) for spring in springs]
    table("least squares over the rows that the screening keeps", springs, kept)
    table("longest straight part", springs, [straight_part(s) for s in springs])


if __name__ == "__main__":
    main()
