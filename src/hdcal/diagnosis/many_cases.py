"""Many cases: read all of them before any work, then diagnose one after the other."""

import multiprocessing
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.cli.compilation_cache import keep_compilations
from hdcal.cli.console import Console
from hdcal.cli.progress import progress_bar
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.errors import Finding, HdcalError, InputError


def read_cases(paths: Sequence[str], gear, columns, theory) -> list[Case]:
    """Read every case.

    Raises:
        InputError: holds everything that is wrong with any of them.
    """
    found: dict[str, Case] = {}
    findings: list[Finding] = []
    for path in paths:
        try:
            case = read_case(path, gear, columns=columns, theory=theory)
            check_effect_priors(case)
        except InputError as error:
            findings += error.findings
            continue
        # Some file systems know no capitals.
        name = case.name.casefold()
        if name in found:
            words = f"a second case is called '{case.name}', as is its result"
            findings.append(Finding(path, words, "Rename one, or run it by itself"))
        found[name] = case
    if findings:
        # One gear file may be behind many cases; its faults are said once.
        raise InputError(dict.fromkeys(findings))
    return list(found.values())


def diagnose_all(
    cases: Sequence[Case], folder: Path, *, jobs: int, **settings
) -> dict[str, dict]:
    """Diagnose every case and write its result.

    Args:
        cases: with names of their own.
        folder: to write into; each of many cases gets a folder inside it.
        jobs: processes.
        settings: library, quick, report, seed.

    Returns:
        Verdicts as plain data by name, in the order of the cases.

    Raises:
        InputError: holds everything that a diagnosis found wrong with its case.
    """
    command = shlex.join(["hdcal", *sys.argv[1:]])
    work = partial(_diagnose_one, command=command, **settings)
    if len(cases) == 1:
        with progress_bar("diagnosing") as progress:
            outcomes = [work(cases[0], folder, progress=progress)]
    else:
        places = [folder / case.name for case in cases]
        for place in places:
            place.mkdir()
        with progress_bar("diagnosing") as progress:
            tasks = list(zip(cases, places, strict=True))
            outcomes = run_all(work, tasks, jobs, progress)
    findings = [finding for _, wrong in outcomes for finding in wrong]
    if findings:
        raise InputError(findings)
    return {case.name: one for case, (one, _) in zip(cases, outcomes, strict=True)}


def _diagnose_one(
    case: Case, folder: Path, *, command, library, quick, report, seed, progress=None
) -> tuple[dict, tuple[Finding, ...]]:
    """Return the verdict and what is wrong with the case, one of them empty."""
    from hdcal.diagnosis.diagnose import diagnose
    from hdcal.diagnosis.library import choose_library
    from hdcal.diagnosis.result_folder import write_verdict
    from hdcal.physics.registry import EFFECTS

    effects = choose_library(library, EFFECTS)
    settings = {"quick": quick, "seed": seed}
    try:
        verdict = diagnose(case, library=effects, progress=progress, **settings)
        written = {"command": command, "report": report, **settings}
        return write_verdict(verdict, folder, **written), ()
    except InputError as error:
        return {}, error.findings
    except (HdcalError, OSError):
        raise
    except Exception as error:
        # Of two hundred cases the one that failed has to be known.
        raise RuntimeError(f"{case.name}: {type(error).__name__}: {error}") from error


def run_all(
    work: Callable,
    tasks: Sequence[tuple],
    jobs: int,
    progress: Callable[[int, int], None] | None = None,
) -> list[Any]:
    """Return what `work` makes of every task, in their order.

    Args:
        work: can be imported by name where there are several jobs.
        tasks: its arguments.
        jobs: processes; one is this process, so that compiled code is used again.
        progress: is told how many tasks of how many are done.
    """
    results: list[Any] = [None] * len(tasks)
    for done, (index, result) in enumerate(completed(work, tasks, jobs), start=1):
        results[index] = result
        if progress is not None:
            progress(done, len(tasks))
    return results


def completed(
    work: Callable, tasks: Sequence[tuple], jobs: int
) -> Iterator[tuple[int, Any]]:
    """Yield the number of a task and what `work` makes of it, as each is done.

    Args:
        work: can be imported by name where there are several jobs.
        tasks: its arguments.
        jobs: processes; one is this process, so that compiled code is used again.
    """
    if min(jobs, len(tasks)) == 1:
        for index, task in enumerate(tasks):
            yield index, work(*task)
        return
    pool = ProcessPoolExecutor(
        min(jobs, len(tasks)),
        # A fork of a process in which JAX has begun hangs.
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_begin,
    )
    try:
        waiting = {pool.submit(work, *task): i for i, task in enumerate(tasks)}
        for future in as_completed(waiting):
            yield waiting.pop(future), future.result()
        pool.shutdown()
    except BaseException:
        # Nobody waits for what others have begun.
        pool.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()
        raise


def _begin() -> None:
    """Prepare a process that works for another, which alone hears the keyboard."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Console(json=False).prepare()
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115, lives as long as the process
    keep_compilations()
