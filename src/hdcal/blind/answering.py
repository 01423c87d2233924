"""Answer a blind check: case by case, each kept as soon as it is there."""

import tempfile
from collections.abc import Generator, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from hdcal.blind.answer_files import AnswerFiles
from hdcal.blind.canonical import canonical, digest
from hdcal.blind.diagnosers import (
    DIAGNOSERS,
    Diagnoser,
    families,
    fingerprint,
    withheld_from,
)
from hdcal.blind.files import refusal
from hdcal.blind.label import CaseAnswer
from hdcal.blind.manifest import Entry
from hdcal.blind.sealed_set import CASES, MATERIAL, SET, BlindSet, read_set
from hdcal.cli.processes import completed
from hdcal.data.plausible import implausible
from hdcal.data.reading import read_case
from hdcal.diagnosis.library import choose_library
from hdcal.errors import Finding, HdcalError, InputError, NotWritable
from hdcal.inference.sample import Progress

# Name of the case, and its answer or else what is wrong.
CaseOutcome = tuple[str, CaseAnswer | None, tuple[Finding, ...]]


@dataclass(frozen=True)
class CaseTask:
    """How one case is to be answered, wherever that happens.

    Attributes:
        entry: the case.
        diagnose: the diagnoser.
        library: withheld from every case, as `--library` reads it.
        fingerprint: hash of what the answer has to be made by.
    """

    entry: Entry
    diagnose: Diagnoser
    library: str | None
    fingerprint: str


def answer_set(
    folder: Path | str,
    *,
    diagnosers: Mapping[str, Diagnoser] = DIAGNOSERS,
    by: str = "hdcal",
    library: str | None = None,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Answer every case of a set and freeze the answers; called again it goes on.

    Args:
        folder: the set.
        diagnosers: who can answer, by name; to be importable by other processes.
        by: who answers.
        library: `minus:NAME[,NAME]`, withheld from every case.
        jobs: processes on this machine.
        scheduler: address of a Dask scheduler whose workers answer instead.
        progress: called with how many cases of how many are answered.

    Returns:
        The frozen answers as plain data.

    Raises:
        InputError: the set, older answers or a case are not what they should be.
    """
    if by not in diagnosers:
        words, known = f"nobody is called '{by}'", ", ".join(sorted(diagnosers))
        raise refusal("by", words, f"Known are: {known}")
    if wrong := implausible("jobs", jobs):
        raise InputError(wrong)
    choose_library(library)
    found = _readable_set(folder)
    entries = {entry.case: entry for entry in found.manifest.cases}
    answers, made_by = AnswerFiles(found, by), fingerprint(library)
    with answers.reserve() as target:
        kept = answers.kept(made_by)
        made = diagnosers[by], library, digest(canonical(made_by))
        tasks = [CaseTask(entries[case], *made) for case in entries if case not in kept]
        # Closed whatever happens: no process works for an answer that is not kept.
        with closing(_outcomes(found, tasks, jobs, scheduler)) as outcomes:
            for done, (case, answer, findings) in enumerate(outcomes, len(kept) + 1):
                if answer is None:
                    raise InputError(findings)
                answers.write(entries[case], answer, made_by)
                if progress is not None:
                    progress(done, len(entries))
        return answers.freeze(target, made_by, families(), library or "")


def _readable_set(folder: Path | str) -> BlindSet:
    """Read a set; this library has to hold what its cases withhold."""
    found = read_set(folder)
    libraries = {entry.library for entry in found.manifest.cases}
    for library in sorted(filter(None, libraries)):
        try:
            choose_library(library)
        except InputError as error:
            words = f"asks for the library '{library}', which hdcal cannot make: "
            words += error.findings[0].problem
            remedy = "Answer it with the version of hdcal that made it"
            raise refusal(found.folder / SET, words, remedy) from None
    return found


def _outcomes(
    found: BlindSet, tasks: list[CaseTask], jobs: int, scheduler: str | None
) -> Generator[CaseOutcome, None, None]:
    if not tasks:
        return
    if scheduler is not None:
        from hdcal.cli.cluster import completed_on_cluster

        work = _travelling(found, tasks)
        yield from completed_on_cluster(answer_there, work, scheduler)
        return
    # A task names its case itself; the list of all would travel with each.
    place = replace(found, manifest=replace(found.manifest, cases=()))
    for _, outcome in completed(answer_here, [(place, t) for t in tasks], jobs):
        yield outcome


def _travelling(found: BlindSet, tasks: list[CaseTask]) -> Iterator[tuple]:
    """Yield tasks with their data, read only when a worker is about to be free."""
    rig = found.gear(), found.material()
    for task in tasks:
        yield task, found.csv(task.entry), *rig


def answer_here(found: BlindSet, task: CaseTask) -> CaseOutcome:
    """Answer a case that this machine's disk holds."""
    try:
        files = found.csv(task.entry), found.gear(), found.material()
    except InputError as error:
        return task.entry.case, None, error.findings
    return answer_bytes(task, *files)


def answer_there(
    task: CaseTask, csv: bytes, gear: bytes, material: bytes | None
) -> CaseOutcome:
    """Answer a case on a worker of a cluster, which shares no disk with anyone."""
    return answer_bytes(task, csv, gear, material)


def answer_bytes(
    task: CaseTask, csv: bytes, gear: bytes, material: bytes | None
) -> CaseOutcome:
    """Answer a case from the bytes of its files."""
    name = task.entry.case
    if digest(canonical(fingerprint(task.library))) != task.fingerprint:
        words = "mixed versions: a worker runs other code, priors or packages"
        remedy = "Give every worker the version that asks"
        return name, None, (Finding(f"{CASES}/{name}.csv", words, remedy),)
    library = choose_library(withheld_from(task.entry.library, task.library))
    try:
        with tempfile.TemporaryDirectory(prefix="hdcal-") as place:
            table, rig = Path(place, f"{name}.csv"), Path(place, "gear.toml")
            table.write_bytes(csv)
            rig.write_bytes(gear)
            own = None
            if material is not None:
                own = Path(place, MATERIAL)
                own.write_bytes(material)
            case = read_case(table, rig, material=own)
        return name, task.diagnose(case, library), ()
    except InputError as error:
        here = (replace(one, file=Path(one.file).name) for one in error.findings)
        return name, None, tuple(here)
    except OSError as error:
        words = f"{name}: cannot be answered ({error.strerror or error})"
        remedy = "Check space and permissions where temporary files go"
        raise NotWritable(f"{words}. {remedy}.") from error
    except HdcalError:
        raise
    except Exception as error:
        # Of a thousand cases the one that failed has to be known.
        raise RuntimeError(f"{name}: {type(error).__name__}: {error}") from error
