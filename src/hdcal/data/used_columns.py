"""The columns of a source that are used, in code units."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.columns import REQUIRED, choose_columns
from hdcal.data.tables.headers import DIMENSIONS, LABELS, parse_header
from hdcal.data.tables.named_columns import Column
from hdcal.data.tables.sources import read_source
from hdcal.data.tables.values import read_values, without_slow_channels
from hdcal.data.value_checks import FEWEST_ROWS, check_values
from hdcal.errors import quoted
from hdcal.quantities import FORCE, TORQUE, Quantities

_READ = (*DIMENSIONS, *LABELS)
# What stands for the quantities of a spring where it is twisted.
_TURNED = {"angle": "deformation", "torque": "force"}
# How a note begins that says what was guessed.
ASSUMED = "ASSUMED: "


@dataclass(frozen=True)
class Columns:
    """The columns that are used, in code units, whether they make sense or not.

    Attributes:
        values: by quantity, floats (NaN where a cell is wrong) or label strings,
            each of shape (n,).
        used: where each quantity stands.
        table: the readings.
        sha256: hash of the source.
        findings: what is wrong with it.
        notes: what was assumed of it.
    """

    values: dict[str, np.ndarray]
    used: dict[str, Column]
    table: ReadTable
    sha256: str
    findings: FileFindings
    notes: tuple[str, ...] = ()

    @property
    def units(self) -> Quantities:
        """Names and units of what was measured."""
        return TORQUE if self._quantity("force") == "torque" else FORCE

    def _quantity(self, name: str) -> str:
        return self.used[name].quantity if name in self.used else name

    def as_named(self) -> dict[str, str]:
        """Return how a user would name each: its header or number, with its unit.

        Those that hdcal's own headers name need no other name.
        """
        named = {}
        for column in self.used.values():
            quantity, header = column.quantity, parse_header(column.header)
            if header.exact and header.quantity == quantity and not column.against:
                continue
            alone = self.table.headers.count(column.header) == 1
            name = column.header if alone else str(column.position + 1)
            enough = alone and header.unit == column.unit
            unit = "" if column.unit is None else column.unit.name
            named[quantity] = name if enough or not unit else f"{name}[{unit}]"
        return named

    def find(self, mask: np.ndarray, quantity: str, problem: str, remedy: str) -> None:
        """Add one finding for the rows where the mask, shape (n,), is true."""
        rows = self.table.rows[mask].tolist()
        header = self.used[quantity].header
        self.findings.add_rows(((row, problem, remedy) for row in rows), header)


def read_columns(
    data: Any,
    mapping: Mapping[str, str] | None,
    findings: FileFindings,
    *,
    quantities: Sequence[str] = _READ,
    required: tuple[str, ...] = REQUIRED,
    fewest: int = FEWEST_ROWS,
) -> Columns:
    """Read the columns of a source that hold known quantities, right or wrong.

    Args:
        data: the file, or a table in memory.
        mapping: quantity -> header with its unit in brackets, or None.
        findings: of the source; gets one for everything that is wrong.
        quantities: what to look for.
        required: which of them must be there.
        fewest: rows that are needed.

    Raises:
        InputError: no table can be found.
    """
    how = {"quantities": quantities, "required": required}
    columns = with_values(find_columns(data, mapping, findings, **how), fewest)
    findings += columns.findings
    return replace(columns, findings=findings)


def find_columns(
    data: Any,
    mapping: Mapping[str, str] | None,
    findings: FileFindings,
    *,
    quantities: Sequence[str] = _READ,
    required: tuple[str, ...] = REQUIRED,
    encoding: str | None = None,
    sheet: str | None = None,
) -> Columns:
    """Return where the columns stand, without their values, as `read_columns` does."""
    table, sha256 = read_source(data, findings, encoding, sheet)
    used = choose_columns(table, mapping or {}, quantities, required, findings)
    if "torque" in used and "force" in required:
        used = {_TURNED.get(quantity, quantity): one for quantity, one in used.items()}
    table, used, left_out = without_slow_channels(table, used, required)
    notes = (*_assumed(table, used), *table.left_out, *left_out)
    return Columns({}, used, table, sha256, findings, notes)


def with_values(found: Columns, fewest: int) -> Columns:
    """Return columns with what stands in them, and findings of that alone."""
    findings = FileFindings(found.findings.file)
    findings.places = found.findings.places
    values, notes = read_values(found.table, found.used, findings)
    runs = found.table.runs
    if runs is not None and "run" not in found.used:
        values["run"] = np.char.mod("%d", runs + 1).astype(object)
        notes.append("the readings below each row of headers are a run")
    notes = (*found.notes, *(f"{ASSUMED}{note}" for note in notes))
    notes = tuple(sorted(notes, key=lambda note: not note.startswith(ASSUMED)))
    columns = replace(found, values=values, findings=findings, notes=notes)
    check_values(columns, fewest)
    return columns


def _assumed(table: ReadTable, used: Mapping[str, Column]) -> Iterator[str]:
    """Yield what was assumed of a source, each with how to say otherwise."""
    for note in table.notes:
        yield f"{ASSUMED}{note}"
    for column in used.values():
        if column.against and column.unit is not None:
            yield (
                f"{ASSUMED}{quoted(column.header)} is in {column.unit.name}, as was "
                f"said, though it names {column.against}"
            )
    guesses = [column for column in used.values() if column.guessed]
    if guesses:
        meanings = ", ".join(
            f"{quoted(column.header)} is the {column.quantity}"
            + ("" if column.unit is None else f" in {column.unit.name}")
            for column in guesses
        )
        first = guesses[0]
        form = "HEADER" if first.unit is None else "HEADER[UNIT]"
        option = f"--column '{first.quantity}={form}'"
        yield f"{ASSUMED}{meanings}. If not, name the column: {option}"
