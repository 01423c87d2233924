"""From the table of a source to readings in code units, checked."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pandas as pd

from hdcal.data.case import Gear
from hdcal.data.findings import FileFindings, row_list
from hdcal.data.measurements.bad_gears import bad_gears, offer
from hdcal.data.measurements.checks import (
    FEWEST_ROWS,
    check_reach,
    check_rows,
    check_whole,
    is_constant,
    rows_back_in_time,
)
from hdcal.data.measurements.labels import mountings, run_labels
from hdcal.data.measurements.notes import ASSUMED, source_notes
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.columns import (
    REQUIRED,
    Column,
    as_named,
    choose_columns,
    in_place_of_force,
)
from hdcal.data.tables.headers import QUANTITIES
from hdcal.data.tables.sources import IN_MEMORY, is_frame, part_sha256, read_source
from hdcal.data.tables.values import read_values, without_slow_channels
from hdcal.errors import Finding, quoted, shortened
from hdcal.quantities import FORCE, TORQUE, Quantities

_LISTED = 20  # labels that one finding names


@dataclass(frozen=True)
class Measurements:
    """Readings in the order in which they were taken, as in `Case`.

    The frame holds columns by quantity, in code units, indexed by the row of the
    source: always deformation, force, `specimen` and `run`, "1" and "" where nothing is
    stated, and `zero`, the number of jumps of a zero before a row.
    """

    frame: pd.DataFrame
    file: str
    sha256: str = ""
    stated: frozenset[str] = frozenset()  # quantities that the source states
    named: dict[str, str] = field(default_factory=dict)  # `Case.columns`
    notes: tuple[str, ...] = ()
    left_out: dict[str, Finding] = field(default_factory=dict)
    units: Quantities = FORCE

    def __getitem__(self, quantity: str) -> np.ndarray:
        """Return a column, shape (n,)."""
        return self.frame[quantity].to_numpy()

    def get(self, quantity: str, default: Any = None) -> Any:
        """Return a column, or the default of one that is not there."""
        return self[quantity] if quantity in self.frame else default

    @property
    def rows(self) -> np.ndarray:
        """Name of each row in the source, shape (n,)."""
        return self.frame.index.to_numpy()

    def where(self, kept: np.ndarray) -> "Measurements":
        """Return the rows that are true in a mask, shape (n,)."""
        return self if kept.all() else replace(self, frame=self.frame.loc[kept])

    def assign(self, **columns: np.ndarray) -> "Measurements":
        """Return the same with other columns, shape (n,) each."""
        return replace(self, frame=self.frame.assign(**columns))

    @property
    def gears(self) -> tuple[np.ndarray, tuple[str, ...]]:
        """Index of each row's gear, shape (n,), and the names of gears."""
        index, names = pd.factorize(self.frame["specimen"])
        return index, tuple(names)

    @property
    def runs(self) -> tuple[np.ndarray, tuple[str, ...]]:
        """Index of each row's mounting, shape (n,), and the names of mountings."""
        return mountings(self.frame)


def read_measurements(
    data: Any,
    mapping: Mapping[str, str] | None = None,
    encoding: str | None = None,
    sheet: str | None = None,
    *,
    gear: Gear | None = None,
    skip_bad: bool | None = None,
) -> Measurements:
    """Read a file or a table in memory; arguments are those of `read_case`."""
    name = IN_MEMORY if is_frame(data) else str(data)
    name = name if sheet is None else f"{name}, sheet {quoted(sheet)}"
    with FileFindings(name) as findings:
        table, sha256 = read_source(data, findings, encoding, sheet)
        chosen = choose_columns(table, mapping or {}, QUANTITIES, REQUIRED, findings)
        used = in_place_of_force(chosen)
        table, used, notes = without_slow_channels(table, used, REQUIRED)
        read = measured_in(table, used, findings, gear, skip_bad=skip_bad)
    used = {name: column for name, column in used.items() if name in read.stated}
    every = source_notes(table, used, [*notes, *read.notes])
    named = as_named(table, used)
    return replace(read, sha256=sha256, named=named, notes=tuple(every))


def measured_in(
    table: ReadTable,
    used: Mapping[str, Column],
    findings: FileFindings,
    gear: Gear | None = None,
    *,
    skip_bad: bool | None = None,
    whole: bool = True,
) -> Measurements:
    """Return the measurements in the columns of a table.

    Gears that are left out have no influence on the others: the decimal sign of cells,
    for example, is judged by the others alone. `whole`: these are all rows of the
    source.
    """
    left_out: dict[str, Finding] = {}
    while True:
        wrong = FileFindings(findings.file)
        read = _measured(table, used, wrong, gear, whole=whole)
        gears = read["specimen"] if wrong.rows else []
        bad = bad_gears(wrong, table.rows, gears)
        many = len({*gears} - {""})
        if not skip_bad or not bad or (whole and len(bad) == many):
            break
        left_out |= bad
        table = table.take(~read.frame["specimen"].isin([*bad]).to_numpy())
    findings += wrong
    findings.rows |= wrong.rows
    if skip_bad is False and bad and (len(bad) < many or not whole):
        findings.append(offer(bad, many if whole else None))
    return replace(read, left_out=left_out)


def _measured(
    table: ReadTable,
    used: Mapping[str, Column],
    findings: FileFindings,
    gear: Gear | None,
    *,
    whole: bool,
) -> Measurements:
    """Return the measurements in columns; faulty cells are NaN and have findings."""
    values, notes = read_values(table, used, findings)
    if table.runs is not None and "run" not in used:
        values["run"] = np.char.mod("%d", table.runs + 1).astype(object)
        notes.append("the readings below each header row are one run")
    frame = pd.DataFrame(values, index=table.rows)
    if whole:
        check_whole(frame, used, findings)
    check_rows(frame, used, findings)
    stated = frozenset(values)
    codes = np.zeros(len(frame), np.int8)
    gears = values.get("specimen", pd.Categorical.from_codes(codes, ["1"]))
    runs = values.get("run", run_labels(values, pd.factorize(gears)[0]))
    runs = pd.Categorical.from_codes(codes, [""]) if runs is None else runs
    frame["specimen"], frame["run"] = pd.Categorical(gears), pd.Categorical(runs)
    frame["zero"] = 0
    force = used.get("force")
    units = TORQUE if force is not None and force.quantity == "torque" else FORCE
    read = Measurements(frame, findings.file, stated=stated, units=units)
    if "time" in frame:
        read = _with_time(read, used["time"], findings)
    if gear is not None and "deformation" in used:
        check_reach(frame, used["deformation"], gear, findings)
    return replace(read, notes=(*read.notes, *(f"{ASSUMED}{note}" for note in notes)))


def _with_time(
    read: Measurements, column: Column, findings: FileFindings
) -> Measurements:
    """Refuse a time that goes back within a run, or drop it where it was guessed."""
    index, names = read.runs
    back = rows_back_in_time(read["time"], index)
    if not back.any():
        return read
    label = quoted(names[index[int(np.argmax(back))]])
    words = "the time decreases within "
    words += f"run {label}" if len(names) > 1 else "a run"
    rows = read.frame.index[back].tolist()
    if not column.guessed:
        remedy = "Keep the order of measurement; label runs in a column 'run' if the "
        remedy += "clock restarts"
        findings.add_rows(((row, words, remedy) for row in rows), column.header)
        return read
    note = f"{ASSUMED}{quoted(column.header)} is not used: {words}, at {row_list(rows)}"
    note += ". If the rig was reset there, label the runs in a column 'run'"
    frame = read.frame.drop(columns="time")
    return replace(read, frame=frame, stated=read.stated - {"time"}, notes=(note,))


def of_specimen(measured: Measurements, label: str) -> Measurements:
    """Return the measurements of one specimen, or raise InputError.

    The hash is that of a part of the source, where it holds several specimens.
    """
    findings, (_, names) = FileFindings(measured.file), measured.gears
    name = quoted(label)
    if label not in names:
        remedy = f"The specimens are {shortened([*map(quoted, names)], _LISTED)}"
        if len(names) == 1:
            remedy = "Name the column of the specimens: `columns` 'specimen=HEADER'"
        findings.refuse(f"no specimen is called {name}", remedy)
    one = measured.where((measured.frame["specimen"] == label).to_numpy())
    if len(one.frame) < FEWEST_ROWS:
        words = f"specimen {name} has {len(one.frame)} rows"
        findings.refuse(words, f"At least {FEWEST_ROWS} are needed")
    if is_constant(one["deformation"]):
        words = f"the {measured.units.displacement} of specimen {name} is constant"
        findings.refuse(words, "Measure at several deformations")
    if len(names) + len(measured.left_out) > 1:
        return replace(one, sha256=part_sha256(measured.sha256, label))
    return one


def read_force(
    path: Any, columns: Mapping[str, str] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Read time [s] and force [N], to drive a model with, shape (n,) each."""
    needed = "time", "force"
    with FileFindings(str(path)) as findings:
        table, _ = read_source(path, findings)
        used = choose_columns(table, columns or {}, needed, needed, findings)
        values, _ = read_values(table, used, findings)
        frame = pd.DataFrame(values, index=table.rows)
        check_whole(frame, used, findings, fewest=2)
        check_rows(frame, used, findings)
        if "time" in frame:
            words = "the time is not later than that of the previous row"
            remedy = "Write a step of the force as two rows with different times"
            back = frame.index[1:][np.diff(frame["time"]) <= 0.0].tolist()
            findings.add_rows(((row, words, remedy) for row in back), "time")
    return frame["time"].to_numpy(), frame["force"].to_numpy()
