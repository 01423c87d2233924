"""Rows that come in batches: of each mounting sums are kept, whatever their number."""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.case import Case
from hdcal.data.measurements.case_of import screened_case
from hdcal.data.measurements.folder import joined
from hdcal.data.measurements.labels import further_labels, mountings, run_labels
from hdcal.data.measurements.measurements import Measurements
from hdcal.data.measurements.notes import mountings_note
from hdcal.data.measurements.parquet import Parquet, read_batches
from hdcal.data.tables.headers import GROUPINGS
from hdcal.errors import Finding, InputError
from hdcal.fleets.gear_sums import MountingSums
from hdcal.fleets.groups import read_by
from hdcal.fleets.readings import (
    FleetReadings,
    largest_of,
    modulus_left,
    row_sums,
)

_LOST = "start again: reading takes a small part of the time"
# First rows that are kept, and notes of the screening.
_SHOWN, _NOTES = 50_000, 20
_SUMS = ("rows", "x", "y", "xx", "xy", "yy")


@dataclass
class Pool:
    """Sums of what was read so far; two of them can be joined.

    Attributes:
        source: where they are from.
        parts: labels, sums and reach of the rows with the same labels in each batch.
        shown: the first rows.
        notes: of their screening.
        left_out: gears of which something is wrong, each with what that is.
    """

    source: Parquet
    parts: list[pd.DataFrame] = field(default_factory=list)
    shown: list[Measurements] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    left_out: dict[str, Finding] = field(default_factory=dict)

    @property
    def keys(self) -> list[str]:
        """Labels by which rows are grouped."""
        stated = [name for name in ("run", *GROUPINGS) if name in self.source.used]
        return ["specimen", "zero", *stated]

    def add(self, found: Measurements) -> None:
        """Add some rows."""
        self.left_out = found.left_out | self.left_out
        self.notes += found.notes
        frame = found.frame
        self._show([] if frame.empty else [found])
        if frame.empty:
            return
        labels = frame[self.keys].astype(dict.fromkeys(self.keys[2:], str))
        of_row = labels.groupby(self.keys, sort=False, observed=True).ngroup()
        of_row, gear, read = of_row.to_numpy(), self.source.gear, found["deformation"]
        warm = found.get("temperature", gear.reference_temperature)
        sums = row_sums(of_row, read * modulus_left(gear, warm), found["force"])
        each = labels.drop_duplicates().astype({"specimen": str})
        each = each.assign(**dict(zip(_SUMS, sums, strict=True)))
        self.parts.append(each.assign(reach=largest_of(of_row, np.abs(read))))

    def _show(self, parts: list[Measurements]) -> None:
        """Keep rows while they are among the first of gears that are not left out."""
        parts, self.shown = [*self.shown, *parts], []
        for part in parts:
            bad = part.frame["specimen"].isin([*self.left_out])
            part = part.where(~bad.to_numpy())
            room = _SHOWN - sum(len(one.frame) for one in self.shown)
            if room > 0 and len(part.frame):
                self.shown.append(replace(part, frame=part.frame[:room]))

    def join(self, other: "Pool") -> None:
        """Add another one, of rows that come after those of this one."""
        self.parts += other.parts
        self.left_out = other.left_out | self.left_out
        self._show(other.shown)
        self.notes += other.notes

    def readings(self) -> FleetReadings:
        """Return what all of them come to, without the gears that are left out.

        Raises:
            InputError: none is left, or none of the first rows.
        """
        table: Any = pd.concat([*self.parts, pd.DataFrame(columns=self.keys)])
        table = table[~table["specimen"].isin([*self.left_out])].reset_index(drop=True)
        if table.empty:
            raise InputError(self.left_out.values())
        specimen, gears = pd.factorize(table["specimen"])
        if "run" not in table:
            stated = {name: table[name].to_numpy() for name in self.keys[2:]}
            labels = run_labels(stated, specimen)
            table["run"] = "" if labels is None else labels
        run, runs = mountings(table)
        further, of_labels = further_labels(table, specimen, tuple(gears), run, runs)
        many = len(mountings(table.assign(zero=0))[1])
        notes = [*mountings_note(self.source.used, many, len(gears)), *of_labels]
        notes += self.notes[:_NOTES]
        if more := len(self.notes[_NOTES:]):
            notes.append(f"and {more} more findings in the records")
        case = replace(
            self._case(table.assign(run_index=run, gear_index=specimen)),
            run_labels=runs,
            specimen_labels=tuple(gears),
            left_out=self.left_out,
            **further,
        )
        case = replace(case, notes=(*self.source.notes, *notes))
        _, first = np.unique(run, return_index=True)
        each, parts = np.arange(len(runs)), _joined_sums(table, run)
        sums = MountingSums(specimen[first], *parts, **read_by(case, each))
        reach = largest_of(run, table["reach"].to_numpy(float))
        return FleetReadings(case, sums, each, reach)

    def _case(self, table: pd.DataFrame) -> Case:
        """Return the first rows as a case, with the gears and runs of all rows.

        Args:
            table: labels of all rows, with the indexes of their gears and runs.
        """
        source, warm = self.source, self.source.gear.reference_temperature
        self._show([])
        if not self.shown:
            words = f"the first {_SHOWN} rows are all of gears that are left out"
            remedy = "Take these gears out of the file"
            raise InputError(
                [*self.left_out.values(), Finding(source.name, words, remedy)]
            )
        found = joined(self.shown, warm, {})
        found = replace(found, sha256=source.sha256, named=source.named)
        case = screened_case(found, None, source.gear, (), source.name)
        labels = found.frame[self.keys].astype(dict.fromkeys(self.keys, str))
        known = table.astype(dict.fromkeys(self.keys, str)).drop_duplicates(self.keys)
        index = labels.merge(known, "left", self.keys, sort=False)
        records = replace(
            case.records,
            run=index["run_index"].to_numpy(),
            specimen=index["gear_index"].to_numpy(),
        )
        return replace(case, records=records)


def _joined_sums(table: pd.DataFrame, index: np.ndarray) -> list[np.ndarray]:
    """Return number, means and sums about them of rows from those of their parts.

    Args:
        table: of the parts.
        index: of the whole of each part, shape (p,).
    """
    rows, x, y, xx, xy, yy = (table[name].to_numpy(float) for name in _SUMS)

    def whole(part: np.ndarray) -> np.ndarray:
        return np.bincount(index, part)

    total = whole(rows)
    mean_x, mean_y = whole(rows * x) / total, whole(rows * y) / total
    off_x, off_y = x - mean_x[index], y - mean_y[index]
    squares = [
        whole(own + rows * between)
        for own, between in ((xx, off_x**2), (xy, off_x * off_y), (yy, off_y**2))
    ]
    return [total, mean_x, mean_y, *squares]


def pool_of(
    source: Parquet, scheduler: str | None = None, *, skip_bad: bool | None = None
) -> Pool:
    """Return what all files come to, whoever reads them.

    Args:
        source: the files.
        scheduler: address of a Dask scheduler, whose workers read them instead; they
            have to find them under the same names.
        skip_bad: as in `read_case`.

    Raises:
        InputError: holds what is wrong with the first batch that is; or nobody answers
            or works there.
        HdcalError: the cluster was lost.
    """
    tasks = ((place, file, source, skip_bad) for place, file in enumerate(source.files))
    if scheduler is None:
        found = (file_pool(*task) for task in tasks)
    else:
        from hdcal.cli.cluster import completed_on_cluster

        found = completed_on_cluster(file_pool, tasks, scheduler, _LOST)
    whole, early, joined_files = Pool(source), {}, 0
    for place, pool in found:
        early[place] = pool
        # In the order of the files, so that the answer depends on no worker.
        while joined_files in early:
            whole.join(early.pop(joined_files))
            joined_files += 1
    return whole


def file_pool(
    place: int, file: str, source: Parquet, skip_bad: bool | None = None
) -> tuple[int, Pool]:
    """Return what one file comes to, and its place among all.

    Raises:
        InputError: holds what is wrong with its first batch that is.
    """
    pool = Pool(source)
    for batch in read_batches(source, file, skip_bad=skip_bad):
        pool.add(batch)
    return place, pool
