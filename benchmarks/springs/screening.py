"""False alarms of the screening on clean records, and its power by fault and size."""

import argparse
from collections import Counter

import numpy as np

from benchmarks.springs.clean import KINDS, NOISES, clean_record
from benchmarks.springs.record import ALL, faulty_spring
from hdcal.screening.screen import screen

# What the screening calls each fault; the others are of the part, and kept.
CALLED = {
    "breaks": "after the largest force",
    "jump_of_force": "jump of the force",
    "jump_of_deformation": "jump of the deformation",
    "tare": "before the tare",
    "opposite_sign": "opposite sign",
    "spikes": "wild reading",
    "jitter": "scatter of the deformation",
}
# Bounds of the sizes, as shares of force or stroke.
SIZES = 0.03, 0.1, 0.3, np.inf


def false_alarms(count: int, rng: np.random.Generator) -> None:
    """Print how many of `count` clean records of each kind give a finding."""
    print("| clean record | " + " | ".join(n.__name__ for n in NOISES) + " |")
    print("|---" * (len(NOISES) + 1) + "|")
    each, what = max(1, count // (len(KINDS) * len(NOISES))), Counter()
    total = 0
    for kind in KINDS:
        cells = []
        for noise in NOISES:
            alarms = 0
            for _ in range(each):
                record = clean_record(rng, kind, noise)
                found = screen(record.deformation, record.force, record.run)
                alarms += bool(found.observations)
                what.update({one.kind for one in found.observations})
            cells.append(f"{alarms} of {each}")
            total += alarms
        print(f"| {kind.__name__} | " + " | ".join(cells) + " |", flush=True)
    whole = each * len(KINDS) * len(NOISES)
    print(f"\nfalse alarms: {total} of {whole} ({total / whole:.2%}); {dict(what)}\n")


def power(count: int, rng: np.random.Generator) -> None:
    """Print in how many records each fault is found, by its size."""
    bounds = [f"to {size:g}" for size in SIZES[:-1]] + ["more"]
    print("| fault | " + " | ".join(bounds) + " | other findings |")
    print("|---" * (len(SIZES) + 2) + "|")
    for name in ALL:
        found, seen, other = Counter(), Counter(), Counter()
        for _ in range(count):
            spring = faulty_spring(rng, [name])
            result = screen(spring.deformation, spring.force)
            kinds = {one.kind for one in result.observations}
            size = int(np.searchsorted(SIZES, abs(spring.faults[name])))
            seen[size] += 1
            found[size] += CALLED.get(name) in kinds
            other.update(kinds - {CALLED.get(name)})
        cells = [
            f"{found[s]} of {seen[s]}" if seen[s] else "" for s in range(len(SIZES))
        ]
        words = ", ".join(f"{n} {kind}" for kind, n in other.items())
        print(f"| {name} | " + " | ".join(cells) + f" | {words} |", flush=True)


def main() -> None:
    """Simulate, screen and count."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.springs.screening")
    parser.description = __doc__
    parser.add_argument("--count", type=int, default=1000, help="clean records")
    parser.add_argument("--power", type=int, default=100, help="records of each fault")
    parser.add_argument("--seed", type=int, default=1, help="fresh ones for each")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    if given.count:
        false_alarms(given.count, rng)
    if given.power:
        power(given.power, rng)


if __name__ == "__main__":
    main()
