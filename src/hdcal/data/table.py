"""Read a table of measurements: one CSV file in, checked columns out."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdcal.data.cells import Values, read_cells
from hdcal.data.columns import LABELS, Column, match_columns
from hdcal.data.layout import Layout, lay_out
from hdcal.data.source_bytes import read_text
from hdcal.data.table_checks import check_time, check_values
from hdcal.data.units import column_to_code
from hdcal.errors import InputError


@dataclass(frozen=True)
class Table:
    """The columns of a file in code units, rows in the order they were taken.

    Attributes:
        values: by quantity, floats or label strings of shape (n,).
        rows: line number of each reading, shape (n,).
        headers: by quantity, as written in the file.
        run: index of the mounting, shape (n,).
        specimen: index of the gear, shape (n,).
        run_labels: by run index.
        specimen_labels: by specimen index.
        sha256: hash of the file's bytes.
        notes: remarks for the log.
    """

    values: Values
    rows: np.ndarray
    headers: dict[str, str]
    run: np.ndarray
    specimen: np.ndarray
    run_labels: tuple[str, ...]
    specimen_labels: tuple[str, ...]
    sha256: str
    notes: tuple[str, ...]


def read_csv(
    path: Path | str, columns: Mapping[str, str] | None = None, *, file: str = ""
) -> Table:
    """Read a CSV file of measurements.

    Args:
        path: the file.
        columns: quantity -> header, the unit in brackets, as in
            `{"force": "Load[kgf]"}`; for headers that do not name themselves.
        file: how to name the file in findings; `path` when empty.

    Raises:
        InputError: holds everything that is wrong with the file.
    """
    file = file or str(path)
    text = read_text(Path(path), file)
    layout, findings = lay_out(text.utf8, file)
    used, wrong = match_columns(layout.headers, columns or {}, file, layout.header_row)
    findings += wrong
    values, wrong = read_cells(layout, used, file)
    findings += wrong
    for quantity, column in used.items():
        if quantity not in LABELS:
            # a wild number may overflow here; the limits below report it
            with np.errstate(over="ignore"):
                converted = column_to_code(values[quantity], quantity, column.unit)
            values[quantity] = converted
    specimen, specimen_labels = _index(values.get("specimen"), layout)
    run, run_labels = _runs(values.get("run"), specimen, specimen_labels, layout)
    findings += check_values(values, used, layout, file)
    if "time" in values:
        findings += check_time(values["time"], run, used["time"], layout, file)
    if findings:
        raise InputError(findings)
    return Table(
        values=values,
        rows=layout.rows,
        headers={quantity: column.header for quantity, column in used.items()},
        run=run,
        specimen=specimen,
        run_labels=run_labels,
        specimen_labels=specimen_labels,
        sha256=text.sha256,
        notes=_notes(used, layout),
    )


def _index(
    labels: np.ndarray | None, layout: Layout
) -> tuple[np.ndarray, tuple[str, ...]]:
    import pandas as pd

    if labels is None:
        return np.zeros(len(layout.rows), int), ("1",)
    codes, names = pd.factorize(labels)
    return codes.astype(int), tuple(str(name) for name in names)


def _runs(
    labels: np.ndarray | None,
    specimen: np.ndarray,
    specimen_labels: tuple[str, ...],
    layout: Layout,
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Runs by label; the same label on two specimens is two mountings."""
    if labels is None:
        return (specimen, specimen_labels) if specimen.any() else _index(None, layout)
    run, names = _index(labels, layout)
    pairs, first, inverse = np.unique(
        run * len(specimen_labels) + specimen, return_index=True, return_inverse=True
    )
    if len(pairs) == len(names):
        return run, names
    order = np.argsort(first, kind="stable")
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    both = [divmod(int(pairs[i]), len(specimen_labels)) for i in order]
    return place[inverse], tuple(f"{specimen_labels[s]}/{names[r]}" for r, s in both)


def _notes(used: dict[str, Column], layout: Layout) -> tuple[str, ...]:
    positions = {column.position for column in used.values()}
    extra = [h for i, h in enumerate(layout.headers) if i not in positions]
    notes = []
    if extra:
        names = ", ".join(f"'{header}'" for header in extra)
        notes.append(f"columns not used: {names}")
    if layout.skipped:
        notes.append(f"{layout.skipped} empty lines between the readings were skipped")
    return tuple(notes)
