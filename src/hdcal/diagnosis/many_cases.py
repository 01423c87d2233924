"""Many cases: read all of them before any work, then diagnose one after the other."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.cli.console import Console
from hdcal.cli.processes import run_all
from hdcal.cli.progress import progress_bar
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.errors import Finding, Findings, HdcalError, InputError


def read_cases(paths: Sequence[str], gear, columns, theory) -> list[Case]:
    """Read every case.

    Raises:
        InputError: holds everything that is wrong with any of them.
    """
    found: dict[str, Case] = {}
    with Findings() as wrong:
        for path in paths:
            case = wrong.attempt(_read, path, gear, columns, theory)
            if case is None:
                continue
            # Some file systems know no capitals.
            name = case.name.casefold()
            if name in found:
                words = f"a second case is called '{case.name}', as is its result"
                wrong.append(Finding(path, words, "Rename one, or run it by itself"))
            found[name] = case
    return list(found.values())


def _read(path: str, gear, columns, theory) -> Case:
    case = read_case(path, gear, columns=columns, theory=theory)
    check_effect_priors(case)
    return case


def tell_notes(console: Console, cases: Sequence[Case]) -> None:
    """Print what was noted while the cases were read."""
    for case in cases:
        for note in case.notes:
            console.words(note if len(cases) == 1 else f"{case.name}: {note}")


def diagnose_all(
    cases: Sequence[Case], folder: Path, *, jobs: int, command: str, **settings
) -> dict[str, VerdictAnswer]:
    """Diagnose every case and write its result.

    Args:
        cases: with names of their own.
        folder: to write into; each of many cases gets a folder inside it.
        jobs: processes.
        command: how the results are made.
        settings: library, quick, report, seed.

    Returns:
        Answers by name, in the order of the cases.

    Raises:
        InputError: holds everything that a diagnosis found wrong with its case.
    """
    work = partial(_diagnose_one, command=command, **settings)
    with progress_bar("diagnosing") as progress:
        if len(cases) == 1:
            outcomes = [work(cases[0], folder, progress=progress)]
        else:
            places = [folder / case.name for case in cases]
            for place in places:
                place.mkdir()
            tasks = list(zip(cases, places, strict=True))
            outcomes = run_all(work, tasks, jobs, progress)
    found = {}
    with Findings() as wrong:
        for case, outcome in zip(cases, outcomes, strict=True):
            if isinstance(outcome, VerdictAnswer):
                found[case.name] = outcome
            else:
                wrong += outcome
    return found


def _diagnose_one(
    case: Case, folder: Path, *, command, library, quick, report, seed, progress=None
) -> VerdictAnswer | tuple[Finding, ...]:
    """Return the answer, or what is wrong with the case."""
    from hdcal.diagnosis.diagnose import diagnose
    from hdcal.diagnosis.library import choose_library
    from hdcal.diagnosis.summary import write_verdict
    from hdcal.physics.registry import EFFECTS

    effects = choose_library(library, EFFECTS)
    settings = {"quick": quick, "seed": seed}
    try:
        verdict = diagnose(case, library=effects, progress=progress, **settings)
        return write_verdict(verdict, folder, command, report=report)
    except InputError as error:
        return error.findings
    except (HdcalError, OSError):
        raise
    except Exception as error:
        # Of two hundred cases the one that failed has to be known.
        raise RuntimeError(f"{case.name}: {type(error).__name__}: {error}") from error
