"""Many cases: read all of them before any work, then diagnose one after the other."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Literal

from hdcal.calibration.known_effects import check_effect_priors
from hdcal.cli.console import Console
from hdcal.cli.processes import run_all
from hdcal.cli.progress import progress_bar
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.errors import Finding, Findings, HdcalError, InputError
from hdcal.report.item import Item
from hdcal.report.result import Result
from hdcal.report.saving import MARKER

if TYPE_CHECKING:
    from hdcal.diagnosis.result import Diagnosis

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


class Row(Item):
    """One of many cases."""

    case: str
    verdict: str
    headline: str
    cause: str
    probability: float | None
    closed: float | None


class Diagnoses(Result):
    """What `hdcal diagnose` answers of many cases.

    Attributes:
        rows: one for each case that was diagnosed.
        cases: their answers, by name.
        refused: what is wrong with the others.
    """

    template = "diagnosis/many.md.j2"
    table = "rows"

    format: Literal["hdcal.verdicts/2"] = "hdcal.verdicts/2"
    rows: tuple[Row, ...]
    cases: dict[str, dict]
    refused: dict[str, tuple[Finding, ...]]

    @property
    def counts(self) -> Counter[str]:
        """How many cases have each verdict."""
        return Counter(row.verdict for row in self.rows)


def overview(found: Mapping[str, "CaseAnswer"], refused: Refused) -> Diagnoses:
    """Return the answers about many cases as one."""
    failed = tuple(
        f"{n}: failed" for n, a in found.items() if a.row.verdict == "FAILED"
    )
    return Diagnoses(
        reasons=failed,
        rows=tuple(answer.row for answer in found.values()),
        cases={name: answer.plain for name, answer in found.items()},
        refused=dict(refused),
    )


@dataclass(frozen=True)
class CaseAnswer:
    """What is left of a diagnosis once its files are written.

    Attributes:
        row: of the overview.
        plain: content of verdict.json.
        shown: the diagnosis itself where there is a single one.
    """

    row: Row
    plain: dict
    shown: "Diagnosis | None"


def diagnose_all(
    asked: AskedCases, folder: Path, *, jobs: int, command: str, **settings
) -> tuple[dict[str, CaseAnswer], AskedCases]:
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
    found: dict[str, CaseAnswer] = {}
    refused = dict(asked.refused)
    for case, outcome in zip(cases, outcomes, strict=True):
        if isinstance(outcome, CaseAnswer):
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
) -> CaseAnswer | tuple[Finding, ...]:
    """Return the answer, or what is wrong with the case."""
    from hdcal.diagnosis.diagnose import diagnose
    from hdcal.diagnosis.library import choose_library
    from hdcal.physics.registry import EFFECTS

    effects = choose_library(library, EFFECTS)
    settings = {"quick": quick, "seed": seed}
    try:
        found = diagnose(case, library=effects, progress=progress, **settings)
        _write(found, folder, command, report=report)
    except InputError as error:
        return error.findings
    except (HdcalError, OSError):
        raise
    except Exception as error:
        return (_defect(case.name, error, alone),)
    which, closed = found.which, found.how_far.closed
    leading = next((c for c in which.causes if c.explains), which.outside)
    row = Row(
        case=case.name,
        verdict=which.verdict if found.status == "ok" else "FAILED",
        headline=found.headline,
        cause=" or ".join(leading.members) or "outside the library",
        probability=leading.probability,
        closed=closed and closed.median,
    )
    return CaseAnswer(row, found.to_dict(), found if alone else None)


def _write(found: "Diagnosis", folder: Path, command: str, *, report: bool) -> None:
    """Write what `hdcal diagnose` leaves behind for one case."""
    from hdcal.report.result_folder import page_files

    files = {"verdict.json": found.to_json().encode()}
    if (average := found.average) is not None:
        from hdcal.inference.posterior_file import FILE_NAME
        from hdcal.prediction.bands.predict import default_bands
        from hdcal.report.table_files import columns_csv

        bands = default_bands([*found.posteriors.values()])
        files["bands.csv"] = columns_csv(dict(bands.to_frame())).encode()
        files[FILE_NAME] = average.to_netcdf()
    if report:
        files |= page_files(found, command)
    for name, content in files.items():
        (folder / name).write_bytes(content)


def _defect(name: str, error: Exception, alone: bool) -> Finding:
    """Return a finding that tells of a defect of hdcal, so that other cases go on.

    Raises:
        RuntimeError: there are no others, or the traceback is wanted.
    """
    if alone or os.environ.get("HDCAL_DEBUG") == "1":
        raise RuntimeError(f"{name}: {type(error).__name__}: {error}") from error
    words = f"internal error ({type(error).__name__}: {error})"
    return Finding(name, words, "Please report it, with what HDCAL_DEBUG=1 prints")
