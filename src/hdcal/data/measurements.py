"""From a source to checked columns, runs and gears."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hdcal.data.bad_gears import among, bad_gears, offer
from hdcal.data.findings import FileFindings, row_list
from hdcal.data.mountings import run_labels
from hdcal.data.tables.grid import factorize
from hdcal.data.tables.sources import source_name
from hdcal.data.used_columns import ASSUMED, Columns, find_columns, with_values
from hdcal.data.value_checks import FEWEST_ROWS, check_values, rows_back_in_time
from hdcal.errors import Finding, InputError, quoted

# Labels that one finding names.
_LISTED = 20


@dataclass(frozen=True)
class Labels:
    """Which of several mountings or gears each row was taken on.

    Attributes:
        index: shape (n,).
        names: by index, in order of appearance.
    """

    index: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True)
class Measurements:
    """What was measured, in code units, in the order it was taken.

    Attributes:
        columns: in which nothing is wrong.
        run: the mountings.
        specimen: the gears.
        left_out: gears that are not among them, each with what is wrong with it.
    """

    columns: Columns
    run: Labels
    specimen: Labels
    left_out: dict[str, Finding] = field(default_factory=dict)

    @property
    def mounted(self) -> bool:
        """Tell whether it was guessed that gears were mounted several times."""
        guessed = "run" not in self.columns.values
        return guessed and len(self.run.names) > len(self.specimen.names)


def read_measurements(
    data: Any,
    mapping: Mapping[str, str] | None = None,
    encoding: str | None = None,
    sheet: str | None = None,
    *,
    check: Callable[[Columns, Labels], None] | None = None,
    skip_bad: bool | None = None,
) -> Measurements:
    """Read a source of measurements.

    Args:
        data: the file, or a table in memory (see `read_source`).
        mapping: quantity -> header, the unit in brackets, as in
            `{"force": "Load[kgf]"}`; for headers that do not name themselves.
        encoding: of the text; by default what it looks like.
        sheet: of a workbook; by default the one with readings.
        check: finds what else is wrong with rows, each of a gear.
        skip_bad: leave out gears of which a row is wrong, whole; False: refuse them,
            and say that this can be asked for.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    left_out: dict[str, Finding] = {}
    with FileFindings(source_name(data)) as findings:
        found = find_columns(data, mapping, findings, encoding=encoding, sheet=sheet)
        while True:
            measured = _measured(found)
            columns, gears = measured.columns, measured.specimen
            if check is not None:
                check(columns, gears)
            wrong, rows = columns.findings, columns.table.rows
            bad = bad_gears(wrong, rows, gears.index, gears.names)
            if not skip_bad or not bad or len(bad) == len(gears.names):
                break
            # As if they had never been in the file: what is guessed of cells, such as
            # their decimal sign, is guessed of all of them.
            left_out |= bad
            kept = ~among(gears.names, bad)[gears.index]
            found = replace(found, table=found.table.take(kept))
        findings += wrong
        if skip_bad is False and 0 < len(bad) < len(gears.names):
            findings.append(offer(bad, len(gears.names)))
    return replace(measured, left_out=left_out)


def _measured(found: Columns) -> Measurements:
    """Return what stands in columns, right or wrong: their findings say."""
    columns = with_values(found, FEWEST_ROWS)
    rows = len(columns.table.rows)
    specimen = labels_of(columns.values.get("specimen"), rows)
    run = runs_of(run_labels(columns.values, specimen.index), specimen, rows)
    return Measurements(_with_time(columns, run), run, specimen)


def _with_time(columns: Columns, run: Labels) -> Columns:
    """Return columns with a time that never goes back within a run, or without one.

    A time that goes back is refused where the user names it, or a header `time_UNIT`,
    and not used where its header was guessed.
    """
    if "time" not in columns.values:
        return columns
    back = rows_back_in_time(columns.values["time"], run.index)
    if not back.any():
        return columns
    label = quoted(run.names[run.index[int(np.argmax(back))]])
    within = f"run {label}" if len(run.names) > 1 else "a run"
    words = f"the time goes back within {within}"
    if not columns.used["time"].guessed:
        remedy = "Keep the order of taking; label runs in a column 'run' if it restarts"
        columns.find(back, "time", words, remedy)
        return columns
    header, rows = (
        columns.used["time"].header,
        row_list(columns.table.rows[back].tolist()),
    )
    note = f"{ASSUMED}{quoted(header)} is not used: {words}, at {rows}. If the rig was "
    note += "reset there, label the runs in a column 'run'"
    values = {name: v for name, v in columns.values.items() if name != "time"}
    used = {name: column for name, column in columns.used.items() if name != "time"}
    return replace(columns, values=values, used=used, notes=(note, *columns.notes))


def of_specimen(measured: Measurements, label: str) -> Measurements:
    """Return what was measured on one of several specimens.

    Raises:
        InputError: none is called so, or it has too few rows, or was not moved.
    """
    findings, names = measured.columns.findings, measured.specimen.names
    if label not in names:
        listed = ", ".join(map(quoted, names[:_LISTED]))
        more = len(names) - _LISTED
        listed += f" and {more} more" if more > 0 else ""
        words = f"no specimen is called {quoted(label)}"
        if len(names) == 1:
            findings.refuse(words, "Say `columns` 'specimen=HEADER', which tells them")
        findings.refuse(words, f"There are {listed}")
    here = measured.specimen.index == names.index(label)
    if np.sum(here) < FEWEST_ROWS:
        words = f"specimen {quoted(label)} has {np.sum(here)} rows"
        findings.refuse(words, f"Take one with {FEWEST_ROWS} or more")
    columns = replace(
        measured.columns,
        values={name: v[here] for name, v in measured.columns.values.items()},
        table=measured.columns.table.take(here),
    )
    check_values(columns, 0)
    if findings:
        raise InputError(findings)
    index, kept = factorize(measured.run.index[here].tolist())
    return Measurements(
        columns,
        Labels(index, tuple(measured.run.names[run] for run in kept)),
        Labels(np.zeros(len(index), int), (label,)),
    )


def labels_of(labels: np.ndarray | None, rows: int) -> Labels:
    """Return which gear each row is of; one where no labels, shape (n,), tell."""
    if labels is None:
        return Labels(np.zeros(rows, int), ("1",))
    index, names = factorize(labels.tolist())
    return Labels(index, tuple(names))


def runs_of(labels: np.ndarray | None, specimen: Labels, rows: int) -> Labels:
    """Runs by label; the same label on two specimens is two mountings."""
    if labels is None:
        return specimen if specimen.index.any() else labels_of(None, rows)
    run, gears = labels_of(labels, rows), len(specimen.names)
    index, pairs = factorize((run.index * gears + specimen.index).tolist())
    if len(pairs) == len(run.names):
        return run
    both = (divmod(pair, gears) for pair in pairs)
    names = (f"{specimen.names[gear]}/{run.names[one]}" for one, gear in both)
    return Labels(index, tuple(names))
