"""Answers to a sealed set: made in parallel, kept one by one, then frozen."""

import json
import os
import signal
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

import platformdirs
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass

import hdcal
from benchmarks.blind.label import ANSWER, Answer
from benchmarks.blind.sealed_set import (
    BlindSet,
    Hash,
    Name,
    digest,
    read_hashed,
    read_set,
    refusal,
    write_hashed,
)

# Answers a case with a library of effects by name.
Diagnoser = Callable[[hdcal.Case, dict], Answer]
_PACKAGES = ("jax", "jaxlib", "numpy", "numpyro", "scipy")
OPENED = "opened.json"
# Read by libraries when a process imports them; a value set by the user stands.
_ENVIRONMENT = {
    "JAX_PLATFORMS": "cpu",
    "JAX_COMPILATION_CACHE_DIR": platformdirs.user_cache_dir("hdcal", False),
    "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    "JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES": "-1",
    # JAX caches no program that may call back to raise an error: NaN is looked for.
    "EQX_ON_ERROR": "nan",
    # Thousands of small systems are solved, for which threads only wait.
    "OPENBLAS_NUM_THREADS": "1",
}


@dataclass(frozen=True)
class Frozen:
    """All answers of one diagnoser to one set.

    Attributes:
        by: name of the diagnoser.
        set: commitment of the set.
        made_by: hash of code, priors and versions.
        blind: whether the set was still sealed.
        answers: in the order of the set.
    """

    by: Name
    set: Hash
    made_by: Hash
    blind: bool
    answers: tuple[Answer, ...]


FROZEN = TypeAdapter(Frozen)


def answer_set(
    folder: Path,
    by: str,
    diagnose: Diagnoser,
    jobs: int = 1,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> tuple[Frozen, str]:
    """Answer every case and freeze the answers; after an interruption, the rest.

    Args:
        folder: the set.
        by: name of the diagnoser.
        diagnose: the diagnoser, importable by other processes.
        jobs: number of processes.
        progress: called with the number of answers and of cases.

    Returns:
        The answers and their hash.

    Raises:
        InputError: the set was changed, or answers exist that are frozen or of another
            version.
    """
    found = read_set(folder)
    target = folder / f"answers-{by}.json"
    if target.exists():
        raise refusal(target, "exists already: these answers are frozen", "Keep them")
    made_by = fingerprint()
    header = {"by": by, "set": found.commitment, "made_by": made_by}
    kept = target.with_suffix(".jsonl")
    answers = _read_kept(kept, header)
    tasks = [entry for entry in found.manifest.cases if entry.case not in answers]
    with kept.open("a", encoding="utf-8") as file:
        if not file.tell():
            file.write(json.dumps(header) + "\n")
        for answer in completed(found, tasks, diagnose, jobs):
            file.write(ANSWER.dump_json(answer).decode() + "\n")
            file.flush()
            answers[answer.case] = answer
            progress(len(answers), len(found.manifest.cases))
    frozen = Frozen(
        by=by,
        set=found.commitment,
        made_by=made_by,
        blind=not (folder / OPENED).exists(),
        answers=tuple(answers[entry.case] for entry in found.manifest.cases),
    )
    sha256 = write_hashed(target, FROZEN, frozen)
    kept.unlink()
    return frozen, sha256


def read_frozen(found: BlindSet) -> dict[str, tuple[Frozen, str]]:
    """Return the frozen answers of everybody, and their hashes, by diagnoser.

    Raises:
        InputError: there are none, or some are unfinished, changed, or of another set.
    """
    for path in sorted(found.folder.glob("answers-*.jsonl")):
        words = "holds answers that are not complete"
        raise refusal(path, words, "Go on with 'answer', or move them away")
    answers = {}
    for path in sorted(found.folder.glob("answers-*.json")):
        frozen, sha256 = read_hashed(path, FROZEN)
        cases = [answer.case for answer in frozen.answers]
        expected = [entry.case for entry in found.manifest.cases]
        if frozen.set != found.commitment or cases != expected:
            raise refusal(path, "answers another set", "Move it away")
        answers[frozen.by] = frozen, sha256
    if not answers:
        raise refusal(found.folder, "holds no answers", "Run 'answer' first")
    return answers


def _read_kept(path: Path, header: dict[str, str]) -> dict[str, Answer]:
    """Return answers of an interrupted run, without a line that was cut off."""
    if not path.exists():
        return {}
    text = path.read_text("utf-8")
    whole = text[: text.rfind("\n") + 1]
    path.write_text(whole, "utf-8")
    first, *lines = whole.splitlines() or [json.dumps(header)]
    if json.loads(first) != header:
        words = "holds answers of another version of hdcal, or to another set"
        raise refusal(path, words, "Go on with that version, or move the file away")
    answers = [ANSWER.validate_json(line) for line in lines]
    return {answer.case: answer for answer in answers}


def completed(found: BlindSet, tasks, diagnose: Callable, jobs: int):
    """Yield answers as they are made, by processes that start afresh.

    Raises:
        RuntimeError: some cases failed; the others were answered before.
    """
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    context = get_context("spawn")
    with ProcessPoolExecutor(jobs, context, initializer=_start) as pool:
        futures = [
            pool.submit(_answer, found.table(each), found.gear, each.withheld, diagnose)
            for each in tasks
        ]
        failed = []
        try:
            for future in as_completed(futures):
                if error := future.exception():
                    failed.append(str(error))
                else:
                    yield future.result()
        finally:
            pool.shutdown(cancel_futures=True)
    if failed:
        raise RuntimeError("; ".join(failed))


def _start() -> None:
    """Leave interruptions to the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _answer(table: Path, gear: Path, withheld, diagnose: Callable):
    library = {n: each for n, each in hdcal.EFFECTS.items() if n not in withheld}
    try:
        return diagnose(hdcal.read_case(table, gear), library)
    except Exception as error:
        raise RuntimeError(f"{table}: {type(error).__name__}: {error}") from error


def fingerprint() -> str:
    """Return a hash of all that decides an answer besides the data."""
    here = Path(__file__).parent
    parts = [f"{name} {version(name)}" for name in _PACKAGES]
    for folder in (Path(hdcal.__file__).parent, here.parents[1] / "priors", here):
        files = sorted([*folder.rglob("*.py"), *folder.rglob("*.toml")])
        parts += [f"{f.relative_to(folder)} {digest(f.read_bytes())}" for f in files]
    return digest("\n".join(parts).encode())
