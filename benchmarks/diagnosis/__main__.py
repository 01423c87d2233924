"""Make cases whose cause is known, diagnose them and count what came out."""

import argparse
import json
import os
from collections.abc import Iterator
from pathlib import Path

# Two processes share the cores; threads of their own only slow each other down.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

_TWO = ("hysteresis", "thermal_zero_drift")
_LINES = (14, 60, 180, 2000)
_LOADINGS = ("rich", "lean")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.diagnosis", description=__doc__
    )
    add = parser.add_argument
    add("--per-class", type=int, default=40, help="cases of each effect")
    add("--r", type=float, nargs="*", default=[0.3, 0.5, 1.0, 2.0, 5.0])
    add("--program", nargs="*", choices=_LOADINGS, default=list(_LOADINGS))
    add("--effects", nargs="*", help="these only; default: every one on the mean")
    add("--nulls", type=int, default=400, help="cases without gap for each noise")
    add("--lines", type=int, default=100, help="cases without gap for each length")
    add("--two", type=int, default=40, help="cases with two effects of r = 1")
    add("--first", type=int, default=0, help="number of the first case of each kind")
    add("--processes", type=int, default=2)
    add("--seed", type=int, default=0)
    add("--out", type=Path, default=Path("diagnosis.json"))
    add("--from", type=Path, nargs="*", dest="earlier", help="only show these results")
    return parser.parse_args()


def tasks(given: argparse.Namespace) -> Iterator:
    """Yield what to make, program after program."""
    from benchmarks.diagnosis.causes import testable
    from benchmarks.diagnosis.score import NOISES, Task, records_of

    def numbers(count: int) -> range:
        return range(given.first, given.first + count)

    for program in given.program:
        can = testable(records_of(program))
        chosen = [n for n in can if not given.effects or n in given.effects]
        for r in given.r:
            for name in chosen:
                for i in numbers(given.per_class):
                    yield Task(program, (name,), r, "iid", i)
        for i in numbers(given.two):
            yield Task(program, _TWO, 1.0, "iid", i)
        for noise in NOISES:
            for i in numbers(given.nulls):
                yield Task(program, (), 0.0, noise, i)
    for rows in _LINES:
        for i in numbers(given.lines):
            yield Task(str(rows), (), 0.0, "iid", i)


def main() -> None:
    from benchmarks.diagnosis.pool import run
    from benchmarks.diagnosis.summary import show

    given = arguments()
    if given.earlier:
        earlier = [json.loads(path.read_text())["rows"] for path in given.earlier]
        show([row for rows in earlier for row in rows])
        return
    rows = run(list(tasks(given)), given.seed, given.processes)
    result = {"scores": show(rows), "rows": rows}
    given.out.write_text(json.dumps(result, indent=1, ensure_ascii=False))


if __name__ == "__main__":
    main()
