"""Columns that the user named, as 'Load [kN]', 'Load[kN]' or '2[kN]'."""

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.headers import DIMENSIONS, LABELS, parse_header, unit_advice
from hdcal.data.units import Unit, find_unit

_SHOWN = 20


@dataclass(frozen=True)
class Column:
    """A column that is used.

    Attributes:
        quantity: one of QUANTITIES.
        header: as written in the file.
        position: 0 = first column.
        unit: of its numbers; None for labels.
        guessed: its header is not spelt `quantity_unit`.
        against: another unit, which its header names itself.
    """

    quantity: str
    header: str
    position: int
    unit: Unit | None = None
    guessed: bool = False
    against: str = ""


def named_column(
    quantity: str, wanted: str, table: ReadTable, findings: FileFindings
) -> Column | None:
    """Return the column that a user named, or None after a finding.

    Args:
        quantity: that it holds.
        wanted: header or number, with the unit in brackets where it names none.
        table: whose headers are read.
        findings: of the file.
    """
    name, unit_text = _split_brackets(wanted)
    places, option = _places(wanted, name, table.headers), f"`columns` {quantity}="
    if len(places) != 1:
        words = f"{option}{wanted} names a column that is not there"
        near = get_close_matches(name, table.headers, 1, 0.4)
        remedy = f"Use a header of the file, such as '{near[0]}'" if near else ""
        remedy = remedy or "Use one of: " + ", ".join(table.headers[:_SHOWN])
        if places:
            words = f"{option}{wanted} fits {len(places)} columns"
            numbers = " or ".join(str(place + 1) for place in places)
            remedy = f"Name it by its number, {numbers}"
        findings.add(words, remedy, table.header_row, name)
        return None
    header = table.headers[places[0]]
    if quantity in LABELS:
        return Column(quantity, header, places[0])
    parsed = parse_header(header)
    in_header = parsed.unit or find_unit(header.rpartition("_")[2])
    unit = in_header if unit_text is None else find_unit(unit_text)
    if unit is None or unit.dimension != DIMENSIONS[quantity]:
        text = parsed.unit_text if unit_text is None else unit_text
        words = f"has no unit that is known for {quantity}"
        words = f"unknown unit '{text}' for {quantity}" if text else words
        remedy = f"Write {option}'{name}[UNIT]'; {unit_advice(text, quantity)}"
        findings.add(words, remedy, table.header_row, header)
        return None
    against = ""
    if in_header not in (None, unit) and in_header.dimension == unit.dimension:
        against = in_header.name
    return Column(quantity, header, places[0], unit, against=against)


def _places(wanted: str, name: str, headers: tuple[str, ...]) -> list[int]:
    """Return the places of the columns that a text may name."""

    def called(names: set[str], texts: list[str]) -> list[int]:
        return [i for i, text in enumerate(texts) if "".join(text.split()) in names]

    # A header may itself end in brackets, so the whole text is tried as well.
    wholes = {"".join(text.split()) for text in (wanted, name)}
    bare = {"".join(name.split())}
    places = called(wholes, [*headers])
    places = places or called(bare, [_split_brackets(header)[0] for header in headers])
    if not places and name.isdigit() and 0 < int(name) <= len(headers):
        return [int(name) - 1]
    return places


def _split_brackets(text: str) -> tuple[str, str | None]:
    """`Load [kgf]` -> (`Load`, `kgf`); no unit where the text ends in no brackets."""
    text = text.strip()
    name, opening, unit = text.removesuffix("]").rpartition("[")
    if not (opening and text.endswith("]")) or "]" in unit:
        return text, None
    return name.rstrip(), unit.strip()


def as_named(table: ReadTable, used: Mapping[str, Column]) -> dict[str, str]:
    """Return how a user would name each column: its header or number, with its unit.

    Columns with hdcal's own headers need no other name.
    """
    named = {}
    for column in used.values():
        quantity, header = column.quantity, parse_header(column.header)
        if header.exact and header.quantity == quantity and not column.against:
            continue
        alone = table.headers.count(column.header) == 1
        name = column.header if alone else str(column.position + 1)
        enough = alone and header.unit == column.unit
        unit = "" if column.unit is None else column.unit.name
        named[quantity] = name if enough or not unit else f"{name}[{unit}]"
    return named
