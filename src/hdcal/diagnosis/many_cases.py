"""Many cases: read all of them before any work, then diagnose one after the other."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from shutil import rmtree

from hdcal.calibration.calibrate import check_effect_priors
from hdcal.cli.console import Console
from hdcal.cli.processes import run_all
from hdcal.cli.progress import progress_bar
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.diagnosis.answer import VerdictAnswer
from hdcal.errors import Finding, Findings, HdcalError, InputError
from hdcal.report.saving import MARKER

Refused = Mapping[str, tuple[Finding, ...]]
# What lies beside the folders of many cases.
REFUSED = "refused.json"
_OWN_FILES = {MARKER, REFUSED}


@dataclass(frozen=True)
class AskedCases:
    """The cases of one call.

    Attributes:
        found: those that could be read, with names of their own.
        refused: what is wrong with the others, by what the user called them.
    """

    found: Sequence[Case]
    refused: Refused

    @property
    def many(self) -> bool:
        """Return whether each case gets a folder of its own."""
        return len(self.found) + len(self.refused) > 1

    @property
    def folder(self) -> str:
        """Return the name of the result folder: of many cases it is no single one's."""
        return "diagnosis" if self.many else f"{self.found[0].name}-diagnosis"

    @property
    def findings(self) -> list[Finding]:
        """Return all that is wrong with any case, once."""
        # One gear file may be behind many cases; its faults are said once.
        return list(dict.fromkeys(f for each in self.refused.values() for f in each))


def read_cases(paths: Sequence[str], **reading) -> AskedCases:
    """Read every case; one that cannot be used does not stop the others.

    Raises:
        InputError: holds everything that is wrong where no case can be used.
    """
    found: dict[str, Case] = {}
    refused: dict[str, tuple[Finding, ...]] = {}
    for path in paths:
        wrong = Findings()
        case = None
        try:
            case = wrong.attempt(_read, path, **reading)
        except (HdcalError, OSError):
            raise
        except Exception as error:
            wrong.append(_defect(path, error, alone=len(paths) == 1))
        if case is not None and case.name.casefold() in found:
            words = f"a second case is called '{case.name}', as is its result"
            wrong.append(Finding(path, words, "Rename one, or run it by itself"))
        if case is not None and len(paths) > 1 and case.name.casefold() in _OWN_FILES:
            words = f"is called '{case.name}', as is a file of the result"
            wrong.append(Finding(path, words, "Rename it, or run it by itself"))
        if wrong:
            refused[path] = (*refused.get(path, ()), *wrong)
        elif case is not None:
            # Some file systems know no capitals.
            found[case.name.casefold()] = case
    asked = AskedCases(list(found.values()), refused)
    if not found:
        raise InputError(asked.findings)
    return asked


def _read(path: str, **reading) -> Case:
    case = read_case(path, **reading)
    check_effect_priors(case)
    return case


def tell_notes(console: Console, asked: AskedCases) -> None:
    """Print what was noted while the cases were read."""
    for case in asked.found:
        for note in case.notes:
            console.words(f"{case.name}: {note}" if asked.many else note)


def diagnose_all(
    asked: AskedCases, folder: Path, *, jobs: int, command: str, **settings
) -> tuple[dict[str, VerdictAnswer], AskedCases]:
    """Diagnose every case and write its result.

    Args:
        asked: the cases.
        folder: to write into; each of many cases gets a folder inside it.
        jobs: processes.
        command: how the results are made.
        settings: library, quick, report, seed.

    Returns:
        Answers by name, in the order of the cases; and the cases, those refused
        among them that a diagnosis found something wrong with.

    Raises:
        InputError: holds everything that is wrong where no case can be used.
    """
    work = partial(_diagnose_one, alone=not asked.many, command=command, **settings)
    cases = asked.found
    with progress_bar("diagnosing") as progress:
        if not asked.many:
            outcomes = [work(cases[0], folder, progress=progress)]
        else:
            places = [folder / case.name for case in cases]
            for place in places:
                place.mkdir()
            tasks = list(zip(cases, places, strict=True))
            outcomes = run_all(work, tasks, jobs, progress)
    found: dict[str, VerdictAnswer] = {}
    refused = dict(asked.refused)
    for case, outcome in zip(cases, outcomes, strict=True):
        if isinstance(outcome, VerdictAnswer):
            found[case.name] = outcome
        else:
            refused[case.name] = outcome
            if asked.many:
                # A defect may have come between two files.
                rmtree(folder / case.name)
    left = AskedCases([case for case in cases if case.name in found], refused)
    if not found:
        raise InputError(left.findings)
    return found, left


def _diagnose_one(
    case: Case,
    folder: Path,
    *,
    alone: bool,
    command: str,
    library: str | None,
    quick: bool,
    report: bool,
    seed: int,
    progress=None,
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
        return (_defect(case.name, error, alone),)


def _defect(name: str, error: Exception, alone: bool) -> Finding:
    """Return a finding that tells of a defect of hdcal, so that other cases go on.

    Raises:
        RuntimeError: there are no others, or the traceback is wanted.
    """
    if alone or os.environ.get("HDCAL_DEBUG") == "1":
        raise RuntimeError(f"{name}: {type(error).__name__}: {error}") from error
    words = f"internal error ({type(error).__name__}: {error})"
    return Finding(name, words, "Please report it, with what HDCAL_DEBUG=1 prints")
