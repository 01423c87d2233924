"""Parquet files of many gears, of whose rows only sums are kept."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.loading import derive_motion, sense_at_turns
from hdcal.data.measurements.case_of import screened_case
from hdcal.data.measurements.folder import joined
from hdcal.data.measurements.labels import further_labels, mountings, run_labels
from hdcal.data.measurements.measurements import Measurements
from hdcal.data.measurements.notes import mountings_note
from hdcal.data.measurements.parquet import Parquet, read_batches
from hdcal.data.measurements.screened import asked_range, screened
from hdcal.data.tables.headers import GROUPINGS
from hdcal.errors import Finding, InputError
from hdcal.fleets.reading.readings import (
    FleetReadings,
    RowSums,
    reading_vectors,
    readings_of,
    relative_modulus,
)
from hdcal.fleets.reading.record_faults import irregular
from hdcal.screening.result import Observation
from hdcal.screening.screen import screen
from hdcal.screening.turning_points import TURN_MOST

_LOST = "start again: reading takes a small part of the time"
# First rows that are kept.
_SHOWN = 50_000
# Scatter of the deformation over its sd from which on screening looks at a record.
_SCATTER = 0.03
# Records that are screened to see what makes most of a batch irregular.
_SAMPLE = 10


@dataclass
class BatchSums:
    """Sums of the rows that were read so far, by the labels of rows in a batch.

    With the first rows, the observations of the screening and their files, and gears
    with a fault.
    """

    source: Parquet
    labels: list[pd.DataFrame] = field(default_factory=list)
    sums: list[RowSums] = field(default_factory=list)
    shown: list[Measurements] = field(default_factory=list)
    observed: list[tuple[str, Observation]] = field(default_factory=list)
    left_out: dict[str, Finding] = field(default_factory=dict)

    @property
    def keys(self) -> list[str]:
        """Labels by which rows are grouped."""
        stated = [name for name in ("run", *GROUPINGS) if name in self.source.used]
        return ["specimen", "zero", *stated]

    def add(self, read: Measurements) -> None:
        """Add the rows of a batch; records that are not regular are screened."""
        self.left_out = read.left_out | self.left_out
        if read.frame.empty:
            return
        wanted = asked_range(self.source.range)
        labels, index, v, sums = self._summed(read)
        odd = _irregular(read, index, v, sums) | (wanted is not None)
        self._keep(read.where(~odd[index]), labels[~odd], sums.where(~odd))
        if not odd.any():
            return
        found, screening = screened(read.where(odd[index]), wanted, True, whole=False)
        self.left_out = found.left_out | self.left_out
        self.observed += [(read.file, each) for each in screening.observations]
        if len(found.frame):
            labels, _, _, sums = self._summed(found, hidden=screening.trembling)
            self._keep(found, labels, sums)

    def _keep(self, read: Measurements, labels: pd.DataFrame, sums: RowSums) -> None:
        self.labels.append(labels.assign(file=read.file))
        self.sums.append(sums)
        self._show([read])

    def _summed(
        self, read: Measurements, *, hidden: bool = False
    ) -> tuple[Any, np.ndarray, np.ndarray, RowSums]:
        """Return labels, index, v and sums of the rows with the same labels."""
        labels: Any = read.frame[self.keys].astype(dict.fromkeys(self.keys[2:], str))
        of_row = labels.groupby(self.keys, sort=False, observed=True).ngroup()
        index = of_row.to_numpy()
        each = labels.drop_duplicates().astype({"specimen": str})
        each = each.assign(row=each.index)
        x, force, gear = read["deformation"], read["force"], self.source.gear
        warm = read.get("temperature", gear.reference_temperature)
        sense = np.ones(len(x)) if hidden else senses(x, index)
        sense = sense_at_turns(sense, x, force, index)
        v = reading_vectors(x * relative_modulus(gear, warm), sense, force)
        return each, index, v, RowSums.of(index, v, x)

    def _show(self, parts: list[Measurements]) -> None:
        """Keep the first rows of gears that are not left out."""
        shown, room = [], _SHOWN
        for part in [*self.shown, *parts]:
            left_out = part.frame["specimen"].isin([*self.left_out])
            frame = part.frame[~left_out][:room] if room else part.frame[:0]
            room -= len(frame)
            shown += [replace(part, frame=frame)] if len(frame) else []
        self.shown = shown

    def join(self, other: "BatchSums") -> None:
        """Add the sums of rows that come after these."""
        self.labels += other.labels
        self.sums += other.sums
        self.observed += other.observed
        self.left_out = other.left_out | self.left_out
        self._show(other.shown)

    def readings(self) -> FleetReadings:
        """Return the readings of the gears that are not left out.

        Raises:
            InputError: none is left, or none of the rows that were kept.
        """
        table: Any = pd.concat([*self.labels, pd.DataFrame(columns=self.keys)])
        table = table.reset_index(drop=True)
        table = table[~table["specimen"].isin([*self.left_out])]
        if table.empty or not self.shown:
            raise InputError(self.left_out.values())
        # In the order of the gears, which is that of their first rows.
        table = table.sort_values(["file", "row"])
        table = table.assign(gear=pd.factorize(table["specimen"])[0])
        table = table.sort_values("gear", kind="stable")
        names = [each.name for each in fields(RowSums)]
        columns = ([getattr(one, name) for one in self.sums] for name in names)
        sums = RowSums(*map(np.concatenate, columns)).where(table.index)
        gear, gears = table["gear"].to_numpy(), table["specimen"].unique()
        if "run" not in table:
            stated = {name: table[name].to_numpy() for name in self.keys[2:]}
            labels = run_labels(stated, gear)
            table["run"] = "" if labels is None else labels
        run, runs = mountings(table)
        further, notes = further_labels(table, gear, tuple(gears), run, runs)
        many = len(mountings(table.assign(zero=0))[1])
        notes = [*mountings_note(self.source.used, many, len(gears)), *notes]
        case = replace(
            self._case(table.assign(index_of_run=run)),
            run_labels=runs,
            specimen_labels=tuple(gears),
            notes=(*self.source.notes, *notes),
            **further,
        )
        _, first = np.unique(run, return_index=True)
        return readings_of(case, gear[first], run[first], sums.joined(run))

    def _case(self, table: pd.DataFrame):
        """Return the first rows as a case; the table has gear and run of all labels."""
        source = self.source
        found = joined(self.shown, source.gear.reference_temperature, {})
        found = replace(found, sha256=source.sha256, named=source.named)
        case = screened_case(found, None, source.gear, (), source.name)
        text = dict.fromkeys(self.keys, str)
        whole = table.astype(text).drop_duplicates(self.keys)
        index = found.frame[self.keys].astype(text).merge(whole, "left", self.keys)
        run, gear = index["index_of_run"].to_numpy(), index["gear"].to_numpy()
        return replace(case, records=replace(case.records, run=run, specimen=gear))


def senses(x: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Return the sense of each row of records with an index, as `derive_motion` does.

    Records without noise in the deformation, most of them, are taken all at once, which
    saves a third of the time of reading.
    """
    order = np.argsort(index, kind="stable")
    read, record = x[order], index[order]
    begins = np.diff(record, prepend=-1) != 0
    step = np.where(begins, 0.0, np.diff(read, prepend=0.0))
    signs = pd.Series(np.where(step == 0.0, np.nan, np.sign(step)))
    signs = signs.groupby(record).ffill().groupby(record).bfill()
    sense = np.empty(len(x))
    sense[order] = signs.fillna(1.0)
    # Records with movements that noise could hide.
    first = begins | (np.diff(sense[order], prepend=0.0) != 0.0)
    travel = np.bincount(np.cumsum(first) - 1, np.abs(step))
    rows = np.flatnonzero(begins)
    span = np.maximum.reduceat(read, rows) - np.minimum.reduceat(read, rows)
    small = travel < TURN_MOST * span[record[first]]
    hard = (np.bincount(record[first], small) > 0.0)[index]
    if hard.any():
        sense[hard] = derive_motion(x[hard], index[hard]).sense
    return sense


def _irregular(
    read: Measurements, index: np.ndarray, v: np.ndarray, sums: RowSums
) -> np.ndarray:
    """Return the records of a batch that screening has to look at, shape (p,)."""
    x, odd = read["deformation"], irregular(sums, v, index)
    if odd.mean() > 0.5:
        rows = np.isin(index, np.flatnonzero(odd)[:_SAMPLE])
        found = screen(x[rows], read["force"][rows], index[rows], whole=False)
        if not found.observations:
            # The noise of all gears is correlated.
            odd = irregular(sums, v, index, relative=True)
    # The deformation of a record may scatter by itself.
    order = np.argsort(index, kind="stable")
    x, record = x[order], index[order]
    bend = np.where(record[2:] == record[:-2], np.diff(x, 2), 0.0)
    scatter = np.bincount(record[2:], bend**2, len(odd)) / 6.0
    off = x - (np.bincount(record, x) / sums.rows)[record]
    return odd | (scatter > _SCATTER**2 * np.bincount(record, off**2))


def parquet_readings(
    source: Parquet, scheduler: str | None = None
) -> tuple[FleetReadings, BatchSums]:
    """Return the readings of all files, and their sums.

    The workers of a Dask scheduler find the files under the same names.

    Raises:
        InputError: a file cannot be read, or nobody answers or works at the address.
        HdcalError: the cluster was lost.
    """
    tasks = ((place, file, source) for place, file in enumerate(source.files))
    found: Iterator[tuple[int, BatchSums]] = (file_sums(*task) for task in tasks)
    if scheduler is not None:
        from hdcal.cli.cluster import completed_on_cluster

        found = completed_on_cluster(file_sums, tasks, scheduler, _LOST)
    whole, early = BatchSums(source), dict[int, BatchSums]()
    following = 0
    for place, part in found:
        early[place] = part
        # In the order of the files, whoever reads them.
        while following in early:
            whole.join(early.pop(following))
            following += 1
    return whole.readings(), whole


def file_sums(place: int, file: str, source: Parquet) -> tuple[int, BatchSums]:
    """Return the sums of one file with its place among all."""
    sums = BatchSums(source)
    for batch in read_batches(source, file, skip_bad=True):
        sums.add(batch)
    return place, sums
