"""Many cases: read all of them before any work, then diagnose one after the other."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from hdcal.calibration.known_effects import check_effect_priors
from hdcal.cli.processes import run_all
from hdcal.cli.progress import progress_bar
from hdcal.data.case import Case
from hdcal.data.reading import read_case
from hdcal.errors import Finding, HdcalError, InputError
from hdcal.report.result import Result
from hdcal.report.saving import MARKER

if TYPE_CHECKING:
    from hdcal.diagnosis.result import Diagnosis
    from hdcal.inference.sample import Progress

Refused = Mapping[str, tuple[Finding, ...]]
# The file of the overview, in the folder that holds those of the cases.
REFUSED = "refused.json"


class Diagnoses(Result):
    """Result of `hdcal diagnose` on many cases, and what is wrong with refused ones."""

    template = "diagnosis/many.md.j2"

    format: Literal["hdcal.verdicts/3"] = "hdcal.verdicts/3"
    cases: dict[str, dict]
    refused: dict[str, tuple[Finding, ...]]

    @property
    def verdicts(self) -> dict[str, str]:
        """The verdict on each case, in a word."""
        return {
            name: "FAILED" if case["reasons"] else case["which"]["verdict"]
            for name, case in self.cases.items()
        }

    @property
    def counts(self) -> Counter[str]:
        """Number of cases with each verdict."""
        return Counter(self.verdicts.values())


def read_cases(paths: Sequence[str], **reading) -> tuple[list[Case], Refused]:
    """Return cases of different names, and what is wrong with the others, by path.

    Raises:
        InputError: holds everything that is wrong where no case can be used.
    """
    found: dict[str, Case] = {}
    refused: dict[str, tuple[Finding, ...]] = {}
    for path in paths:
        try:
            case = read_case(path, **reading)
            check_effect_priors(case)
            # Some file systems do not distinguish capitals.
            name = case.name.casefold()
            if len(paths) > 1 and name in (*found, MARKER, REFUSED):
                words = f"the name '{name}' of its result is already used"
                remedy = "Rename the case, or diagnose it separately"
                raise InputError([Finding(path, words, remedy)])
            found[name] = case
        except Exception as error:
            wrong = _wrong(path, error, alone=len(paths) == 1)
            refused[path] = (*refused.get(path, ()), *wrong)
    if not found:
        raise InputError(all_findings(refused))
    return [*found.values()], refused


def all_findings(refused: Refused) -> list[Finding]:
    """Return all that is wrong with any case, once: cases may share a gear file."""
    return list(dict.fromkeys(f for each in refused.values() for f in each))


def diagnose_many(
    cases: Sequence[Case], refused: Refused, folder: Path, *, jobs: int, **how
) -> Diagnoses:
    """Diagnose cases of different names, each into a folder of its name.

    Raises:
        InputError: holds everything that is wrong where no case can be used.
    """
    tasks = [(case, folder / case.name) for case in cases]
    with progress_bar("diagnosing") as progress:
        outcomes = run_all(partial(_diagnosed, **how), tasks, jobs, progress)
    by_name = {case.name: out for case, out in zip(cases, outcomes, strict=True)}
    found = {n: out for n, out in by_name.items() if isinstance(out, dict)}
    refused = {**refused, **{n: o for n, o in by_name.items() if n not in found}}
    if not found:
        raise InputError(all_findings(refused))
    together = Diagnoses(
        reasons=tuple(f"{n}: {why}" for n, c in found.items() for why in c["reasons"]),
        cases=found,
        refused=refused,
    )
    (folder / REFUSED).write_text(together.to_json(), "utf-8")
    return together


def _diagnosed(case: Case, place: Path, **how) -> dict | tuple[Finding, ...]:
    """Return verdict.json of a case, or what is wrong with it."""
    try:
        return diagnose_into(place, case, **how).to_dict()
    except Exception as error:
        return _wrong(case.name, error)


def diagnose_into(
    folder: Path,
    case: Case,
    *,
    command: str,
    library: str | None,
    quick: bool,
    report: bool,
    seed: int,
    progress: "Progress | None" = None,
) -> "Diagnosis":
    """Diagnose a case, and write the result once all files are made."""
    from hdcal.diagnosis.diagnose import diagnose
    from hdcal.diagnosis.library import choose_library
    from hdcal.report.result_folder import page_files

    how = {"library": choose_library(library), "quick": quick, "seed": seed}
    found = diagnose(case, progress=progress, **how)
    files = {"verdict.json": found.to_json().encode()}
    if (average := found.average) is not None:
        from hdcal.inference.posterior_file import FILE_NAME

        files[FILE_NAME] = average.to_netcdf()
    if report:
        files |= page_files(found, command)
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    return found


def _wrong(name: str, error: Exception, *, alone: bool = False) -> tuple[Finding, ...]:
    """Return what is wrong with a case; raise what stops the other ones too."""
    if isinstance(error, InputError):
        return tuple(error.findings)
    debug = os.environ.get("HDCAL_DEBUG") == "1"
    if alone or debug or isinstance(error, HdcalError | OSError):
        raise error
    words = f"internal error ({type(error).__name__}: {error})"
    remedy = "Please report it, with what HDCAL_DEBUG=1 prints"
    return (Finding(name, words, remedy),)
