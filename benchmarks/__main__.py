"""Run the benchmarks: all of them, or those named."""

import argparse
from importlib import import_module

NAMES = (
    "processes",
    "peers",
    "samplers",
    "rows",
    "reading",
    "tracking",
    "verdicts",
    "designs",
    "certificates",
    "fleets",
    "causes",
)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("which", nargs="*", metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--repeats", type=int, default=5, help="medians are of these")
    given = parser.parse_args()
    if unknown := set(given.which) - set(NAMES):
        parser.error(f"no such benchmark: {', '.join(sorted(unknown))}")
    if given.repeats < 1:
        parser.error("--repeats has to be 1 or more")
    # This process stays small: a child's peak memory never reads below its parent's.
    for name in given.which or NAMES:
        print(f"\n## {name}\n", flush=True)
        import_module(f"benchmarks.{name}").main(given.repeats)


if __name__ == "__main__":
    main()
