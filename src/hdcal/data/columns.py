"""From headers to columns: which one holds which quantity, and in which unit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from hdcal.data.csv_table import CsvTable
from hdcal.data.findings import FileFindings
from hdcal.data.header_words import GROUPINGS, guess_header
from hdcal.data.label_columns import label_columns
from hdcal.data.units import COLUMN_UNITS, known_unit
from hdcal.errors import quoted

LABELS = ("run", "specimen", *GROUPINGS)
QUANTITIES = (*COLUMN_UNITS, *LABELS)
REQUIRED = ("deformation", "force")
_LONGEST_FIRST = sorted(QUANTITIES, key=len, reverse=True)


@dataclass(frozen=True)
class Column:
    """One column that is used.

    Attributes:
        quantity: one of QUANTITIES.
        header: as written in the file.
        position: 0 = first column.
        unit: one of COLUMN_UNITS[quantity]; empty for labels.
        guessed: its header says so in other words than hdcal's own.
        against: another unit, which its header names itself.
    """

    quantity: str
    header: str
    position: int
    unit: str = ""
    guessed: bool = False
    against: str = ""


@dataclass(frozen=True)
class Columns:
    """The columns that are used, in code units, whether they make sense or not.

    Attributes:
        values: by quantity, floats (NaN where a cell is wrong) or label strings,
            each of shape (n,).
        used: where each quantity stands.
        table: the whole table.
        sha256: hash of the file's bytes.
        findings: what is wrong with the file.
        notes: what was guessed of it.
    """

    values: dict[str, np.ndarray]
    used: dict[str, Column]
    table: CsvTable
    sha256: str
    findings: FileFindings
    notes: tuple[str, ...] = ()

    def as_named(self) -> dict[str, str]:
        """Return how a user would name each: its header or number, with its unit.

        Those that hdcal's own headers name need no other name.
        """
        named = {}
        for quantity, column in self.used.items():
            own, unit = _split(column.header)
            if own == quantity and known_unit(quantity, unit) in (column.unit, None):
                continue
            guess = guess_header(column.header)
            alone = self.table.headers.count(column.header) == 1
            name = column.header if alone else str(column.position + 1)
            told = alone and guess is not None and guess.unit == column.unit
            named[quantity] = name if told else f"{name}[{column.unit}]"
            if quantity in LABELS:
                named[quantity] = name
        return named

    def find(self, mask: np.ndarray, quantity: str, problem: str, remedy: str) -> None:
        """Add one finding for each row where the mask, shape (n,), is true."""
        rows = self.table.rows[mask].tolist()
        header = self.used[quantity].header
        self.findings.add_rows(((row, problem, remedy) for row in rows), header)


def match_columns(
    table: CsvTable,
    mapping: Mapping[str, str],
    quantities: Sequence[str],
    required: Sequence[str],
    findings: FileFindings,
) -> dict[str, Column]:
    """Find each quantity's column by its name, or by what the user said.

    Args:
        table: whose headers are read.
        mapping: quantity -> header with the unit in square brackets.
        quantities: what to look for.
        required: which of them must be there.
        findings: of the file; gets one for each header that is wrong or missing.

    Returns:
        The columns by quantity.
    """
    for quantity in mapping:
        if quantity not in QUANTITIES:
            near = get_close_matches(quantity, QUANTITIES, 1, 0.5)
            hint = f"Did you mean {near[0]}? " if near else ""
            words = f"`columns` {quantity}=… names no quantity that hdcal knows"
            findings.add(words, f"{hint}Known are: {', '.join(QUANTITIES)}")
    columns: dict[str, Column] = {}
    for quantity in quantities:
        if quantity in mapping:
            column = _mapped(quantity, mapping[quantity], table, findings)
        else:
            needed = quantity in required
            column = _named(quantity, needed, table, findings)
        if column is not None:
            columns[quantity] = column
    owners: dict[int, str] = {}
    for quantity, column in columns.items():
        other = owners.setdefault(column.position, quantity)
        if other != quantity:
            words = f"is used both as {other} and as {quantity}"
            remedy = "Give each quantity a column of its own"
            findings.add(words, remedy, table.header_row, column.header)
    return columns


def _named(
    quantity: str, needed: bool, table: CsvTable, findings: FileFindings
) -> Column | None:
    good: list[Column] = []
    bad: list[tuple[str, str]] = []
    for position, header in enumerate(table.headers):
        name, unit = _split(header)
        if name != quantity:
            continue
        known = known_unit(quantity, unit)
        if known is not None:
            good.append(Column(quantity, header, position, known))
        elif quantity not in LABELS:
            bad.append((header, unit))
    if len(good) > 1:
        names = " and ".join(f"'{column.header}'" for column in good)
        words = f"two columns hold the {quantity}: {names}"
        findings.add(words, "Keep one of them", table.header_row, good[1].header)
        return None
    if good:
        return good[0]
    before = len(findings)
    if not bad and (guessed := _guessed(quantity, table, findings)):
        return guessed
    if len(findings) > before:
        return None
    if bad:
        header, unit = bad[0]
        words = f"unknown unit '{unit}'" if unit else "the header names no unit"
        findings.add(words, _unit_remedy(quantity, unit), table.header_row, header)
    elif needed:
        words = f"no column holds the {quantity}"
        remedy = _name_remedy(quantity, table.headers)
        findings.add(words, remedy, table.header_row, quantity)
    return None


def _guessed(quantity: str, table: CsvTable, findings: FileFindings) -> Column | None:
    """Return the column whose header means a quantity, in other words than ours."""
    if quantity in LABELS:
        return _labels(quantity, table, findings)
    found = [
        (Column(quantity, header, position, guess.unit, guessed=True), guess.whole)
        for position, header in enumerate(table.headers)
        if (guess := guess_header(header)) is not None and guess.quantity == quantity
    ]
    # One that names nothing else is meant rather than one that says more.
    likely = [one for one, alone in found if alone] or [one for one, _ in found]
    # A lot of German rings is a Charge, which is a load in French: that has a unit.
    likely = [column for column in likely if column.unit] or likely
    if len(likely) > 1 and quantity in REQUIRED:
        _ask_which(quantity, [column.position for column in likely], table, findings)
    if len(likely) != 1:
        return None
    (column,) = likely
    if not column.unit:
        words = f"may be the {quantity}, but names no unit"
        units = ", ".join(COLUMN_UNITS[quantity])
        remedy = (
            f"Say `columns` '{quantity}={column.header}[UNIT]' with one of: {units}"
        )
        if quantity in REQUIRED:
            findings.add(words, remedy, table.header_row, column.header)
        return None
    return column


def _labels(quantity: str, table: CsvTable, findings: FileFindings) -> Column | None:
    found = label_columns(table, quantity)
    if len(found) > 1 and quantity not in GROUPINGS:
        _ask_which(quantity, found, table, findings)
    alone = [Column(quantity, table.headers[at], at, guessed=True) for at in found]
    return alone[0] if len(alone) == 1 else None


def _ask_which(
    quantity: str, places: Sequence[int], table: CsvTable, findings: FileFindings
) -> None:
    words = " or ".join(quoted(table.headers[place]) for place in places)
    words = f"the {quantity} may be {words}"
    remedy = f"Say which, by its number: `columns` '{quantity}={places[0] + 1}'"
    findings.add(words, remedy, table.header_row, table.headers[places[1]])


def _split(header: str) -> tuple[str, str]:
    """`force_sd_N` -> (`force_sd`, `N`); ('', '') when it names no quantity."""
    lowered = header.lower()
    for quantity in _LONGEST_FIRST:
        if lowered == quantity or lowered.startswith(quantity + "_"):
            return quantity, header[len(quantity) + 1 :]
    return "", ""


def _unit_remedy(quantity: str, unit: str) -> str:
    units = COLUMN_UNITS[quantity]
    near = [known for known in units if known.lower() == unit.lower()]
    hint = f" (did you mean {near[0]}?)" if near else ""
    return f"Name it {quantity}_UNIT with one of: {', '.join(units)}{hint}"


def _name_remedy(quantity: str, headers: Sequence[str]) -> str:
    example = f"{quantity}_{COLUMN_UNITS[quantity][0]}"
    near = [header for header in headers if quantity in header.lower()]
    near += get_close_matches(example, headers, 1, 0.6)
    named = near[0] if near else "HEADER"
    unit = "[UNIT]" if _split_brackets(named)[1] is None else ""
    known = "" if near else f", HEADER one of: {', '.join(map(quoted, headers[:20]))}"
    return f"Name it like {example}, or say `columns` '{quantity}={named}{unit}'{known}"


def _mapped(
    quantity: str, wanted: str, table: CsvTable, findings: FileFindings
) -> Column | None:
    name, unit = _split_brackets(wanted)
    # a header may itself end in brackets, so the whole text is tried as well
    wholes = {_squeezed(wanted), _squeezed(name)}
    hits = [i for i, header in enumerate(table.headers) if _squeezed(header) in wholes]
    if not hits:
        bare = [_squeezed(_split_brackets(header)[0]) for header in table.headers]
        hits = [i for i, header in enumerate(bare) if header == _squeezed(name)]
    if not hits and name.isdigit() and 0 < int(name) <= len(table.headers):
        hits = [int(name) - 1]
    option = f"`columns` {quantity}="
    if not hits:
        near = get_close_matches(name, table.headers, 1, 0.4)
        remedy = f"Use a header of the file, such as '{near[0]}'" if near else ""
        remedy = remedy or "Use one of: " + ", ".join(table.headers[:20])
        words = f"{option}{wanted} names a column that is not there"
        findings.add(words, remedy, table.header_row, name)
        return None
    if len(hits) > 1:
        words = f"{option}{wanted} fits {len(hits)} columns"
        numbers = " or ".join(str(hit + 1) for hit in hits)
        remedy = f"Name it by its number, {numbers}"
        findings.add(words, remedy, table.header_row, name)
        return None
    header = table.headers[hits[0]]
    if quantity in LABELS:
        return Column(quantity, header, hits[0])
    guess, own = guess_header(header), _split_brackets(header)[1]
    own = own or (guess.unit if guess is not None else "")
    own = own or (header.rpartition("_")[2] if "_" in header else "")
    known = known_unit(quantity, unit or own)
    if known is None:
        words = f"has no unit that is known for {quantity}"
        if unit is not None:
            words = f"unknown unit '{unit or own}' for {quantity}"
        units = ", ".join(COLUMN_UNITS[quantity])
        remedy = f"Write {option}'{name}[UNIT]' with one of: {units}"
        findings.add(words, remedy, table.header_row, header)
        return None
    against = known_unit(quantity, own) if own else None
    against = against if against not in (None, known) else ""
    return Column(quantity, header, hits[0], known, against=against)


def _split_brackets(text: str) -> tuple[str, str | None]:
    """`Load [kgf]` -> (`Load`, `kgf`); no unit where the text ends in no brackets."""
    text = text.strip()
    name, opening, unit = text.removesuffix("]").rpartition("[")
    if not (opening and text.endswith("]")) or "]" in unit:
        return text, None
    return name.rstrip(), unit.strip()


def _squeezed(text: str) -> str:
    return "".join(text.split())
