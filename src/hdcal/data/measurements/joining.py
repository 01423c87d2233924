"""Measurements of several sources below each other: files of a folder, batches."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pandas as pd

from hdcal.data.measurements.measurements import Measurements
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.tables.headers import GROUPINGS
from hdcal.errors import Finding


def labelled(measured: Measurements, label: str) -> Measurements:
    """Return measurements with the gear of each row, and the file in its row's name.

    A gear of two files was mounted for each of them.
    """
    frame = measured.frame.set_axis([f"{row} of {label}" for row in measured.rows])
    if "specimen" not in measured.stated:
        frame = frame.assign(specimen=label)
    else:
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
