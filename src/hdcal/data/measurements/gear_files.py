"""Files of a folder that hold a gear each, and the name of each gear."""

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from hdcal.errors import Finding, InputError, quoted, shortened

DATA_NAME, GEAR_NAME = "data.csv", "gear.toml"
MARKER = "hdcal-result.json"  # file in each folder that hdcal wrote as a result
# Tables of readings by their names. A text may be a remark: it counts as one only where
# nothing else does.
_TABLES = (".csv", ".tsv", ".dat", ".asc", ".lvm", ".xlsx", ".parquet")
_TEXT = ".txt"
_LISTED = 3


def gear_files(data: Any) -> list[Path]:
    """Return the files of a folder that has one for each gear; none of other data.

    A folder that hdcal wrote as a result is an InputError.
    """
    if not isinstance(data, str | Path) or not os.path.isdir(data):
        return []
    if os.path.exists(Path(data) / MARKER):
        words, remedy = "is a result of hdcal, not data", "Name the data. Results are "
        remedy += "read by predict, margin, respond, design, study, track and compare"
        raise InputError([Finding(str(data), words, remedy)])
    inside = sorted(one for one in Path(data).iterdir() if one.name[0] not in "._")
    if any(one.name == DATA_NAME for one in inside):
        return []
    cases = [one / DATA_NAME for one in inside if (one / DATA_NAME).is_file()]
    kinds = {one: one.suffix.lower() for one in inside if one.is_file()}
    files = [one for one, kind in kinds.items() if kind in _TABLES]
    texts = [one for one, kind in kinds.items() if kind == _TEXT]
    return cases + (files or ([] if cases else texts))


def gear_labels(files: Sequence[Path], folder: Path) -> tuple[list[str], bool]:
    """Return the names of the gears, and whether each has a folder; or InputError."""
    cases = [file for file in files if file.parent != folder]
    if cases and len(cases) < len(files):
        words = f"contains folders of gears, such as {cases[0].parent.name}, and files"
        remedy = f"Keep folders or files only; {files[-1].name} is a file"
        raise InputError([Finding(str(folder), words, remedy)])
    labels = [(file.parent.name if cases else file.stem).strip() for file in files]
    words, remedy = "is the name of several gears", "Rename all but one file"
    if twice := [label for label, many in Counter(labels).items() if many > 1]:
        raise InputError(
            Finding(str(folder), f"{quoted(one)} {words}", remedy) for one in twice
        )
    return labels, bool(cases)


def file_of_gear(data: Path, label: str | None) -> Path:
    """Return the file of a gear in a folder that has one for each; else the data."""
    files = gear_files(data)
    if not files:
        return data
    labels, cases = gear_labels(files, data)
    if label in labels:
        file = files[labels.index(label)]
        return file.parent if cases else file
    words = "contains a file for each gear, not one case"
    words += "" if label is None else f"; none is named {quoted(label)}"
    remedy = "Use `hdcal fleet`, or select one gear with `specimen`"
    raise InputError([Finding(str(data), words, remedy)])


def not_read(files: Sequence[Path], folder: Path) -> Iterator[str]:
    """Yield a note on the other content of the folder."""
    known = {GEAR_NAME, *(file.relative_to(folder).parts[0] for file in files)}
    inside = sorted(one.name for one in folder.iterdir())
    others = [one for one in inside if one not in known and not one.startswith(".")]
    if others:
        names = shortened(others, _LISTED)
        yield f"not read, neither a table nor a folder with {DATA_NAME}: {names}"
