"""Answers to a sealed set: made in parallel, kept one by one, then frozen."""

import json
import math
import os
import signal
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

import platformdirs
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass

import hdcal
from benchmarks.blind.label import ANSWER, NONE, UNKNOWN, Answer
from benchmarks.blind.rivals import fit_each
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
from hdcal.diagnosis.decision import decide
from hdcal.physics.effect import Effect

Library = Mapping[str, type[Effect]]
Diagnoser = Callable[[hdcal.Case, Library], Answer]
COARSE = "quantisation"
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
        groups: group of each effect of the library.
        answers: in the order of the set.
    """

    by: Name
    set: Hash
    made_by: Hash
    blind: bool
    groups: dict[str, str]
    answers: tuple[Answer, ...]


FROZEN = TypeAdapter(Frozen)


def by_hdcal(case: hdcal.Case, library: Library) -> Answer:
    """Answer as `hdcal diagnose` decides."""
    found = decide(case, library)
    # That readings are coarse is a fact, and an explanation where nothing else acts.
    coarse = found.coarse_step > 0.0 and COARSE in library
    plain = COARSE if coarse else NONE

    def names(each) -> tuple[str, ...]:
        return (UNKNOWN,) if each.outside else each.effects or (plain,)

    which = found.which
    chances = {"+".join(names(e)): e.probability for e in found.explanations}
    members = [name for each in which.set for name in names(each)]
    inclusion = {name: which.effects.get(name, 0.0) for name in library}
    inclusion |= {COARSE: chances.get(COARSE, 0.0)} if coarse else {}
    best = max(inclusion, key=lambda name: inclusion[name])
    cause = next((c for c in which.causes if best in c.members), None)
    group, acts = (
        (cause.members, cause.probability) if cause else ((best,), inclusion[best])
    )
    verdict = _verdict(chances, group, acts)
    silent = verdict in (NONE, UNKNOWN)
    size = cause.explains if cause and not silent else None
    return Answer(
        case=case.name,
        verdict=verdict,
        effect=None if silent else best,
        second_effect=None,
        set=tuple(dict.fromkeys(members)),
        probabilities={NONE: 0.0, UNKNOWN: 0.0, **chances},
        inclusion=inclusion,
        detected=coarse or found.gap > 0.5,
        closed=(size.median, size.lo, size.hi) if size else None,
        group_members=() if silent else group,
    )


def _verdict(chances: dict[str, float], group: tuple[str, ...], acts: float):
    """Return the verdict of a decision; a class of one is named from 95 % on."""
    none, outside = chances.get(NONE, 0.0), chances.get(UNKNOWN, 0.0)
    if none >= 0.5:
        return NONE
    if outside >= max(acts, none):
        return UNKNOWN
    if acts >= 0.95 and len(group) == 1:
        return "named"
    return "group" if acts >= 0.9 else "ambiguous"


def by_none(case: hdcal.Case, library: Library) -> Answer:
    """Answer that there is no gap, whatever the data say: a floor for scores."""
    return _certain(case, library, {NONE: 1.0})


def by_r2(case: hdcal.Case, library: Library) -> Answer:
    """Answer with the effect that fits best in sample."""
    found = fit_each(case, library)
    best = min((n for n in found if n != NONE), key=lambda name: found[name].square)
    return _certain(case, library, {best: 1.0})


def by_bic(case: hdcal.Case, library: Library) -> Answer:
    """Answer with the weights of the Bayesian information criterion."""
    found = {name: fit.bic for name, fit in fit_each(case, library).items()}
    least = min(found.values())
    odds = {name: math.exp(-0.5 * (bic - least)) for name, bic in found.items()}
    total = sum(odds.values())
    return _certain(case, library, {name: each / total for name, each in odds.items()})


def _certain(case: hdcal.Case, library: Library, chances: dict[str, float]) -> Answer:
    """Return the answer of a method that knows neither pairs nor the unknown."""
    best = max(chances, key=lambda name: chances[name])
    effect = None if best == NONE else best
    return Answer(
        case=case.name,
        verdict="named" if effect else "none",
        effect=effect,
        second_effect=None,
        set=(best,),
        probabilities={**dict.fromkeys((NONE, UNKNOWN, *library), 0.0), **chances},
        inclusion={name: chances.get(name, 0.0) for name in library},
        detected=effect is not None,
    )


DIAGNOSERS: dict[str, Diagnoser] = {
    "hdcal": by_hdcal,
    "bic": by_bic,
    "r2": by_r2,
    "none": by_none,
}


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
        for answer in _completed(found, tasks, diagnose, jobs):
            file.write(ANSWER.dump_json(answer).decode() + "\n")
            file.flush()
            answers[answer.case] = answer
            progress(len(answers), len(found.manifest.cases))
    frozen = Frozen(
        by=by,
        set=found.commitment,
        made_by=made_by,
        blind=not (folder / OPENED).exists(),
        groups={name: effect.groups[0] for name, effect in hdcal.EFFECTS.items()},
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


def _completed(found: BlindSet, tasks, diagnose: Diagnoser, jobs: int):
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


def _answer(table: Path, gear: Path, withheld, diagnose: Diagnoser) -> Answer:
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
