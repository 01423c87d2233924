"""A folder with a file, or a folder, for each gear: many rigs write such."""

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.bad_gears import offer
from hdcal.data.case import Case, Gear
from hdcal.data.case_of import case_of
from hdcal.data.findings import FileFindings
from hdcal.data.gear import read_gear
from hdcal.data.gear_files import gear_files, gear_labels, not_read
from hdcal.data.measurements import Measurements, labels_of, read_measurements, runs_of
from hdcal.data.mountings import run_labels
from hdcal.data.reading import GEAR_NAME, asked_columns, gear_of
from hdcal.data.reading_notes import mountings_note, unused_columns
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.tables.grid import ArrayGrid
from hdcal.data.tables.headers import GROUPINGS
from hdcal.data.theory_names import SPRING
from hdcal.data.too_far import too_far
from hdcal.data.used_columns import Columns
from hdcal.errors import Finding, Findings

# What may differ between the files of gears of one kind, as dotted keys begin.
_OWN = ("gear.wall_thickness_mm", "gear.radius_mm", "gear.length_mm")
_OWN += ("gear.load_height_mm", "gear.name", "gear.nominal_deformation_mm", "columns.")
_SIZES = ("wall_thickness", "radius", "length", "load_height")


@dataclass(frozen=True)
class _Part:
    """What one file holds.

    Attributes:
        label: of its gear, where the file names none.
        measured: what was read.
        gear: as the file beside it says; None where each has none.
    """

    label: str
    measured: Measurements
    gear: Gear | None

    @property
    def named(self) -> bool:
        """Tell whether the file says itself which gear a row is of."""
        return "specimen" in self.measured.columns.used

    @property
    def gears(self) -> tuple[str, ...]:
        """Return the labels of its gears."""
        return self.measured.specimen.names if self.named else (self.label,)


def read_gear_folder(
    data: Path | str,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    theory: str | None = None,
    reading: str | None = None,
    encoding: str | None = None,
    skip_bad: bool | None = None,
    range: str | None = None,
) -> tuple[Case, dict[str, list] | None]:
    """Read a folder with a file for each gear, or with a folder for each.

    Where a file names no gears, all of its rows are of the one that it, or its folder,
    is called after.

    Args:
        data: a folder of which `gear_files` knows.
        gear: as in `read_case`; by default the gear.toml in the folder, or that of the
            first gear. Others may differ from it in their sizes.
        columns: as in `read_case`.
        theory: likewise.
        reading: likewise.
        range: likewise.
        encoding: likewise.
        skip_bad: likewise. A file that cannot be read is a gear that is bad.

    Raises:
        InputError: holds everything that is wrong with any file.

    Returns:
        The case, and a table of the sizes of each gear where they have files.
    """
    asked, (named, _) = (theory, None, reading), asked_columns(data, columns)
    files, folder = gear_files(data), Path(data)
    labels, cases = gear_labels(files, folder)
    own = [file.parent / GEAR_NAME for file in files] if cases else []
    own = own if any(map(os.path.exists, own)) else []
    beside = folder / GEAR_NAME
    if gear is None and own and not beside.exists():
        gear = next(filter(os.path.exists, own))
    whose = str(beside) if gear is None else "`gear`"
    whose = str(gear) if isinstance(gear, str | Path) else whose
    with Findings() as wrong:
        found, told = wrong.attempt(gear_of, gear, beside, False, asked) or (None, ())
        parts, unread = [], {}
        how = {"encoding": encoding, "skip_bad": skip_bad or None}
        for place, (file, label) in enumerate(zip(files, labels, strict=True)):
            each, its = Findings(), None
            if own:
                its = each.attempt(read_gear, own[place], *asked)
            if its is not None and found is not None:
                each += _differences(its, found, own[place], whose)
            measured = each.attempt(_measured, file, its or found, named, **how)
            if each:
                unread[label] = each
            elif measured is not None:
                parts.append(_Part(label, measured, its))
        wrong += _unread(parts, unread, skip_bad=skip_bad)
    assert found is not None
    whole = _joined(parts, found.reference_temperature)
    bad = {label: _why(each[0], folder) for label, each in unread.items()}
    for part in parts:
        bad |= part.measured.left_out
    kind = "folder" if cases else "file"
    notes = [f"each {kind} is a gear, called after it, unless it names gears itself"]
    compared = f"the gear file, with sizes at which gears are compared, is {whose}"
    notes += [compared] if own else []
    notes += [*not_read(files, folder), *_untold(parts)]
    if any(part.measured.mounted for part in parts):
        many = len(whole.run.names), len(whole.specimen.names)
        notes.append(mountings_note(whole.columns.values, *many))
    whole = replace(whole, left_out=bad)
    case = case_of(
        whole, found, (*notes, *told), folder.resolve().name, range, skip_bad
    )
    return case, _sizes(parts) if own and found.theory != SPRING else None


def _unread(
    parts: Sequence[_Part], unread: Mapping[str, Findings], *, skip_bad: bool | None
) -> list[Finding]:
    """Return what stops all: files that cannot be read, unless they may be left out.

    Where others name gears themselves nobody knows whose rows such a file holds.
    """
    known = not any(part.named for part in parts)
    if skip_bad and known and parts:
        return []
    found = [finding for each in unread.values() for finding in each]
    if unread and known and parts and skip_bad is False:
        bad = {label: each[0] for label, each in unread.items()}
        found.append(offer(bad, len(parts) + len(bad)))
    return found


def _why(first: Finding, folder: Path) -> Finding:
    """Return why a gear is left out; where no row says in which file, the words do."""
    if first.row is not None:
        return first
    return Finding(str(folder), f"{first.where}: {first.problem}", first.remedy)


def _measured(
    file: Path, gear: Gear | None, columns: dict[str, str], **how
) -> Measurements:
    """Return what one file holds, as its gear file and the user name its columns."""
    named = dict(gear.source.get("columns", {}) if gear is not None else {})
    check = None if gear is None else partial(too_far, gear=gear)
    return read_measurements(file, named | columns, check=check, **how)


def _differences(one: Gear, other: Gear, file: Path, whose: str) -> Iterator[Finding]:
    """Yield what a gear file says otherwise than that of all gears, beside sizes."""
    mine, theirs = (dict(_flat(each.source)) for each in (one, other))
    remedy = "Gears of one kind differ in their sizes only"
    keys = [key for key in sorted({*mine, *theirs}) if not key.startswith(_OWN)]
    keys = [key for key in keys if mine.get(key) != theirs.get(key)]
    for key in keys:
        said, there = (str(each.get(key, "not stated")) for each in (mine, theirs))
        words = f"is {said}, and {there} in {whose}"
        yield Finding(str(file), words, remedy, None, key)
    priors = (
        {n: (p.family, p.numbers) for n, p in g.priors.items()} for g in (one, other)
    )
    if not keys and len({str(each) for each in priors}) > 1:
        words = f"its material is another one than in {whose}"
        yield Finding(str(file), words, remedy, None, "gear.material")


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{above}{key}.")
        else:
            yield f"{above}{key}", value


def _sizes(parts: Sequence[_Part]) -> dict[str, list]:
    """Return the sizes of each gear as a table; one of two sizes stands there twice."""
    rows = [
        (gear, *(float(getattr(part.gear.geometry, name)) for name in _SIZES))
        for part in parts
        if part.gear is not None
        for gear in part.gears
    ]
    columns = zip(*dict.fromkeys(rows), strict=True)
    names = "specimen", *(f"{name}_mm" for name in _SIZES)
    return {name: [*column] for name, column in zip(names, columns, strict=True)}


# What a file that does not state it leaves open, beside labels.
_OPEN = ("temperature", "run", *GROUPINGS)


def _untold(parts: Sequence[_Part]) -> Iterator[str]:
    """Yield a note on what some files state and others do not."""
    each = [{*part.measured.columns.values} - {"specimen", *_OPEN} for part in parts]
    for name in sorted(set.union(*each) - set.intersection(*each)):
        many = sum(name in told for told in each)
        yield f"{name} is not read: {many} of {len(each)} files state it"


def _joined(parts: Sequence[_Part], warm: float) -> Measurements:
    """Return the rows of all files below each other.

    Args:
        parts: the files.
        warm: temperature of those that state none [°C].
    """
    each = [_rows(part) for part in parts]
    names = dict.fromkeys(name for values in each for name in values)
    blank = {"temperature": warm, "run": ""} | dict.fromkeys(GROUPINGS, NOT_STATED)
    values = {}
    for name in names:
        if all(name in rows for rows in each) or name in blank:
            columns = (
                rows.get(name, np.full(len(rows["force"]), blank.get(name)))
                for rows in each
            )
            values[name] = np.concatenate([*columns])
    rows = len(values["force"])
    specimen = labels_of(values["specimen"], rows)
    run = runs_of(values.get("run"), specimen, rows)
    hashes = "".join(part.measured.columns.sha256 for part in parts)
    notes = (
        note
        for part in parts
        for columns in [part.measured.columns]
        for note in (*columns.notes, *unused_columns(columns))
    )
    grid = ArrayGrid(_places(parts), 0, [], values.__getitem__)
    table = ReadTable((), 0, grid, rows)
    columns = Columns(
        values,
        {},
        table,
        hashlib.sha256(hashes.encode()).hexdigest(),
        FileFindings(parts[0].measured.columns.findings.file),
        tuple(dict.fromkeys(notes)),
    )
    return Measurements(columns, run, specimen)


def _rows(part: _Part) -> dict[str, np.ndarray]:
    """Return the columns of a file, with gear and mounting of each row."""
    measured = part.measured
    values = dict(measured.columns.values)
    index = measured.specimen.index if part.named else np.zeros_like(measured.run.index)
    values["specimen"] = np.array(part.gears, object)[index]
    runs = run_labels(values, index)
    if part.named:
        # A gear of two files was mounted for each of them.
        runs = np.full(len(index), "") if runs is None else runs
        runs = np.array([f"{part.label} {run}".strip() for run in runs], object)
    return values if runs is None else values | {"run": runs}


def _places(parts: Sequence[_Part]) -> np.ndarray:
    """Return how each row is called: its line and its file."""
    return np.array(
        [
            f"{row} of {part.label}"
            for part in parts
            for row in part.measured.columns.table.rows
        ],
        object,
    )
