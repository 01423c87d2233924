"""Seal cases, answer them without their causes, open the seal and score.

python -m benchmarks.blind make --cases 40 --out check
python -m benchmarks.blind answer check --jobs 2
python -m benchmarks.blind open check --key check.key
"""

import argparse
import secrets
import sys
from importlib.metadata import version
from pathlib import Path

from benchmarks.blind.answers import answer_set
from benchmarks.blind.cases import GEAR_TOML, draw_cases
from benchmarks.blind.diagnosers import DIAGNOSERS
from benchmarks.blind.measurement import sealed_measurement
from benchmarks.blind.mixes import MIXES, RIGS
from benchmarks.blind.opening import open_set
from benchmarks.blind.sealed_set import GEAR, write_set
from benchmarks.blind.temperature import compare_temperatures
from hdcal.errors import InputError

# With fewer somebody could draw the cases of every seed and see which ones fit.
_SEED_BITS = 128
_INTERRUPTED = 130


def _parser() -> argparse.ArgumentParser:
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.blind", description=__doc__, formatter_class=form
    )
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("make", help="seal cases, or a measurement")
    make.add_argument("--out", type=Path, required=True, help="set to make")
    make.add_argument("--key", type=Path, help="file with the labels [OUT.key]")
    make.add_argument("--cases", type=int, default=310)
    make.add_argument("--mix", choices=MIXES, default=RIGS)
    make.add_argument("--seed", type=int, help="of the draws, secret [random]")
    make.add_argument("--from", dest="table", type=Path, help="CSV to seal instead")
    make.add_argument("--gear", type=Path, help="its gear file")
    make.add_argument("--cause", default="", help="its effects, or 'outside'")
    make.add_argument("--withhold", default="", help="effects it is answered without")
    answer = commands.add_parser("answer", help="answer every case, or go on with it")
    answer.add_argument("folder", type=Path)
    answer.add_argument("--by", choices=DIAGNOSERS, default="hdcal")
    answer.add_argument("--jobs", type=int, default=1, help="processes [1]")
    opening = commands.add_parser("open", help="verify everything, and score")
    opening.add_argument("folder", type=Path)
    opening.add_argument("--key", type=Path, required=True)
    fit = commands.add_parser("temperature", help="compare temperatures, once opened")
    fit.add_argument("folder", type=Path)
    fit.add_argument("--key", type=Path, required=True)
    fit.add_argument("--jobs", type=int, default=1, help="processes [1]")
    return parser


def main(arguments: list[str] | None = None) -> int:
    """Run a command and return its exit code."""
    given = _parser().parse_args(arguments)
    try:
        _COMMANDS[given.command](given)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("\ninterrupted; run the same command again to go on", file=sys.stderr)
        return _INTERRUPTED
    return 0


def _make(given: argparse.Namespace) -> None:
    seed = secrets.randbits(_SEED_BITS) if given.seed is None else given.seed
    if given.table is None:
        mix, files = given.mix, {GEAR: GEAR_TOML.encode()}
        cases = draw_cases(mix, given.cases, seed)
        drawn = ((text.encode(), label) for text, label in cases)
    else:
        gear = given.gear or given.table.with_name(GEAR)
        table, label, files = sealed_measurement(
            given.table, gear, given.cause, given.withhold
        )
        mix, drawn = "", iter([(table, label)])
    key = given.key or given.out.with_name(f"{given.out.name}.key")
    made = write_set(
        given.out,
        key,
        drawn,
        files,
        mix=mix,
        seed=seed,
        version=version("hdcal"),
    )
    print(f"commitment {made.commitment}")
    words = f"{len(made.manifest.cases)} sealed: {given.out}; their labels: {key}"
    print(words, file=sys.stderr)


def _answer(given: argparse.Namespace) -> None:
    def progress(done: int, count: int) -> None:
        print(f"\r{given.by}: {done} of {count}", end="", file=sys.stderr, flush=True)

    diagnose = DIAGNOSERS[given.by]
    frozen, sha256 = answer_set(given.folder, given.by, diagnose, given.jobs, progress)
    print(file=sys.stderr)
    print(f"answers {sha256} by '{given.by}'")
    if not frozen.blind:
        print("NOT BLIND: this set was opened before", file=sys.stderr)


def _open(given: argparse.Namespace) -> None:
    print(open_set(given.folder, given.key))


def _temperature(given: argparse.Namespace) -> None:
    print(compare_temperatures(given.folder, given.key, given.jobs))


_COMMANDS = {
    "make": _make,
    "answer": _answer,
    "open": _open,
    "temperature": _temperature,
}


if __name__ == "__main__":
    sys.exit(main())
