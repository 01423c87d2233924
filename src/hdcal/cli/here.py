"""What one could do next with what lies in a folder."""

import os.path
import shlex
from collections.abc import Iterator
from pathlib import Path

_TABLES = {".csv", ".txt", ".tsv", ".lvm", ".dat", ".xlsx", ".parquet", ".mat"}
# Number of cases and of tables that are named.
_MOST = 3
_RESULTS = {
    "posterior.nc": "hdcal margin {name} --deformation MM --limit-force N",
    "verdict.json": "open {name}/report.html",
}


def what_next(folder: Path) -> Iterator[str]:
    """Yield commands that fit the files of a folder, each with what it does."""
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return
    cases = [e for e in [folder, *entries] if os.path.isfile(e / "data.csv")]
    tables = [
        e for e in entries if e.suffix.lower() in _TABLES and e.name != "data.csv"
    ]
    for case in cases[:_MOST]:
        name = "." if case == folder else _quoted(case.name)
        yield f"hdcal calibrate {name} --out result"
        yield f"hdcal diagnose {name} --out verdict"
    for table in tables[:_MOST]:
        yield f"hdcal check {_quoted(table.name)}"
    for entry in entries:
        for file, command in _RESULTS.items():
            if os.path.isfile(entry / file):
                yield command.format(name=_quoted(entry.name))
                break


def _quoted(name: str) -> str:
    """Return a name as a shell takes it, and no option."""
    return shlex.quote(f"./{name}" if name.startswith("-") else name)
