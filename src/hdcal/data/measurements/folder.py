"""A folder with a file, or a folder, for each gear."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.case import Case, Gear
from hdcal.data.gear import read_gear
from hdcal.data.measurements.bad_gears import offer
from hdcal.data.measurements.case_of import case_of
from hdcal.data.measurements.gear_files import (
    GEAR_NAME,
    gear_files,
    gear_labels,
    not_read,
)
from hdcal.data.measurements.measurements import Measurements, read_measurements
from hdcal.data.reading import asked_columns, gear_of, unsized
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.tables.headers import GROUPINGS
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, Findings

# First parts of the dotted keys that may differ between the files of gears of one kind.
_OWN = ("gear.wall_thickness_mm", "gear.radius_mm", "gear.length_mm")
_OWN += ("gear.load_height_mm", "gear.name", "gear.nominal_deformation_mm", "columns.")
_SIZES = ("wall_thickness", "radius", "length", "load_height")
# What one file holds, its specimens named, and its gear; None where it has none.
_Part = tuple[Measurements, Gear | None]


def read_gear_folder(
    data: Path | str,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    encoding: str | None = None,
    skip_bad: bool | None = None,
    range: str | None = None,
) -> tuple[Case, dict[str, list] | None]:
    """Read a folder with a file, or a folder, for each gear; arguments as `read_case`.

    Where a file names no gears, all of its rows are of the one that it, or its folder,
    is called after. A file that cannot be read is a bad gear. The gear is by default
    the gear.toml in the folder, or that of the first gear; others differ in sizes.

    Returns:
        The case, and a table of the sizes of each gear where they have gear files.
    """
    named, _ = asked_columns(data, columns)
    files, folder = gear_files(data), Path(data)
    labels, cases = gear_labels(files, folder)
    own = [file.parent / GEAR_NAME for file in files] if cases else []
    own = own if any(path.exists() for path in own) else []
    nearby = folder / GEAR_NAME
    if gear is None and own and not nearby.exists():
        gear = next(path for path in own if path.exists())
    base = str(nearby) if gear is None else "`gear`"
    base = str(gear) if isinstance(gear, str | Path) else base
    parts: list[_Part] = []
    unread: dict[str, Findings] = {}
    with Findings() as wrong:
        described = wrong.attempt(gear_of, gear, nearby, False)
        common, notes = described or (None, ())
        for place, (file, label) in enumerate(zip(files, labels, strict=True)):
            each = Findings()
            its = each.attempt(read_gear, own[place]) if own else None
            if its is not None and common is not None:
                each += _differences(its, common, own[place], base)
            here = its or common
            mine = named if here is None else here.source.get("columns", {}) | named
            how: dict = {"gear": here, "skip_bad": skip_bad or None}
            measured = each.attempt(read_measurements, file, mine, encoding, **how)
            if measured is not None and parts:
                each += _other_kind(measured, parts[0][0])
            if each:
                unread[label] = each
            elif measured is not None:
                parts.append((labelled(measured, label), its))
        wrong += _unread(parts, unread, skip_bad=skip_bad)
    assert common is not None
    bad = {label: each[0] for label, each in unread.items()}
    for label, why in bad.items():
        if why.row is None:
            words = f"{why.where}: {why.problem}"
            bad[label] = Finding(str(folder), words, why.remedy)
    warm = [part["temperature"] for part, _ in parts if "temperature" in part.frame]
    common, notes = unsized(common, notes, np.concatenate([[], *warm]))
    whole = joined([part for part, _ in parts], common.reference_temperature, bad)
    kind = "folder" if cases else "file"
    about = [f"each {kind} is one gear with its name, unless a column names the gears"]
    compared = f"gears are compared at the sizes of the gear file {base}"
    about += [*([compared] if own else []), *not_read(files, folder)]
    about += _stated_by_some([part.stated for part, _ in parts])
    name = folder.resolve().name
    case = case_of(whole, common, (*about, *notes), name, range, skip_bad)
    return case, _sizes(parts) if own and common.theory != SPRING else None


def _other_kind(one: Measurements, first: Measurements) -> Iterator[Finding]:
    """Yield a finding where one file holds torques and the other one forces."""
    if one.units != first.units:
        words = f"contains {one.units.load}s, but {first.file} {first.units.load}s"
        yield Finding(one.file, words, "Keep only files of one kind in a folder")


def _unread(
    parts: Sequence[_Part], unread: Mapping[str, Findings], *, skip_bad: bool | None
) -> list[Finding]:
    """Return findings on files that cannot be read, unless they may be left out."""
    # Where others name gears themselves nobody knows which gears such a file holds.
    known = bool(parts) and not any("specimen" in part.stated for part, _ in parts)
    if skip_bad and known:
        return []
    findings = [finding for each in unread.values() for finding in each]
    if unread and known and skip_bad is False:
        bad = {label: each[0] for label, each in unread.items()}
        findings.append(offer(bad, len(parts) + len(bad)))
    return findings


def _differences(one: Gear, other: Gear, file: Path, base: str) -> Iterator[Finding]:
    """Yield differences of a gear file from that of all gears, but for sizes."""
    mine, theirs = map(_of_kind, (one, other))
    for key in sorted({*mine, *theirs}):
        if mine.get(key) != theirs.get(key):
            here, there = (str(each.get(key, "not stated")) for each in (mine, theirs))
            words = f"is {here}, but {there} in {base}"
            remedy = "Gears of a fleet may differ in their sizes only"
            yield Finding(str(file), words, remedy, None, key)


def _of_kind(gear: Gear) -> dict[str, Any]:
    """Return what all gears of a kind share, by dotted keys of the gear file."""
    stated = pd.json_normalize(gear.source).to_dict("records")[0]
    # Materials of one name may stand in several files.
    priors = [f"{n} {gear.priors[n].numbers}" for n in ("E0", "alpha")]
    stated["gear.material"] = f"{gear.material} with {' and '.join(priors)}"
    return {str(k): v for k, v in stated.items() if not str(k).startswith(_OWN)}


def _sizes(parts: Sequence[_Part]) -> dict[str, list]:
    """Return the sizes of each gear as a table; one of two sizes stands there twice."""
    rows = dict.fromkeys(
        (label, *(float(getattr(gear.geometry, name)) for name in _SIZES))
        for part, gear in parts
        if gear is not None
        for label in part.gears[1]
    )
    names = ["specimen", *(f"{name}_mm" for name in _SIZES)]
    return pd.DataFrame([*rows], columns=names).to_dict("list")


def _stated_by_some(stated: Sequence[frozenset[str]]) -> Iterator[str]:
    """Yield a note on each quantity that some files state and others do not."""
    each = [names - {"specimen", "temperature", "run", *GROUPINGS} for names in stated]
    for name in sorted(frozenset().union(*each) - each[0].intersection(*each)):
        many = sum(name in names for names in each)
        yield f"{name} is not used, because only {many} of {len(each)} files contain it"


def labelled(measured: Measurements, label: str) -> Measurements:
    """Return measurements with the gear of each row, and the file in its row's name."""
    frame = measured.frame.set_axis([f"{row} of {label}" for row in measured.rows])
    if "specimen" not in measured.stated:
        frame = frame.assign(specimen=label)
    else:  # a gear of two files was mounted for each of them
        runs = frame["run"].cat.rename_categories(lambda run: f"{label} {run}".strip())
        frame = frame.assign(run=runs)
    return replace(measured, frame=frame)


def joined(
    parts: Sequence[Measurements], warm: float, bad: Mapping[str, Finding]
) -> Measurements:
    """Return the rows of all parts below each other."""
    blank = {"temperature": warm, **dict.fromkeys(GROUPINGS, NOT_STATED)}
    frames = [part.frame for part in parts]
    names = dict.fromkeys(name for frame in frames for name in frame)
    kept = [n for n in names if n in blank or all(n in frame for frame in frames)]
    frames = [
        frame.assign(**{n: blank[n] for n in kept if n not in frame})[kept]
        for frame in frames
    ]
    labels = dict.fromkeys(("specimen", "run"), str)
    whole: Any = pd.concat([frame.astype(labels) for frame in frames])
    left_out = {gear: why for part in parts for gear, why in part.left_out.items()}
    hashes = "".join(part.sha256 for part in parts)
    return replace(
        parts[0],
        frame=whole.astype(dict.fromkeys(labels, "category")),
        sha256=hashlib.sha256(hashes.encode()).hexdigest(),
        stated=frozenset().union(*(part.stated for part in parts)),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
        left_out={**bad, **left_out},
    )
