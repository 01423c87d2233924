"""Names by which a user says which column is which: header or number, and unit."""

from collections.abc import Mapping, Sequence

from hdcal.data.findings import FileFindings, did_you_mean
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.headers import QUANTITIES


def check_names(
    table: ReadTable, mapping: Mapping[str, str], findings: FileFindings
) -> None:
    """Refuse a table without headers, and quantities that do not exist."""
    if not table.named and not any(text[:1].isdigit() for text in mapping.values()):
        words = f"no header row names the {len(table.headers)} columns: the first row "
        words += "contains numbers"
        remedy = "Add a header row, or name the columns by their numbers, as in "
        remedy += "`columns` deformation=1[mm] and `columns` force=2[kN]"
        findings.refuse(words, remedy, table.header_row)
    for quantity in (name for name in mapping if name not in QUANTITIES):
        words = f"`columns` {quantity}=… is not a known quantity"
        findings.add(words, did_you_mean(quantity, [*QUANTITIES]))


def places_named(wanted: str, headers: Sequence[str]) -> list[int]:
    """Return the places of the columns that a text may name."""

    def called(names: set[str], texts: Sequence[str]) -> list[int]:
        return [i for i, text in enumerate(texts) if "".join(text.split()) in names]

    name = split_brackets(wanted)[0]
    # A header may itself end in brackets, so the whole text is tried as well.
    places = called({"".join(text.split()) for text in (wanted, name)}, headers)
    bare = [split_brackets(header)[0] for header in headers]
    places = places or called({"".join(name.split())}, bare)
    if not places and name.isdigit() and 0 < int(name) <= len(headers):
        return [int(name) - 1]
    return places


def split_brackets(text: str) -> tuple[str, str | None]:
    """`Load [kgf]` -> (`Load`, `kgf`); no unit where the text ends in no brackets."""
    text = text.strip()
    name, opening, unit = text.removesuffix("]").rpartition("[")
    if not (opening and text.endswith("]")) or "]" in unit:
        return text, None
    return name.rstrip(), unit.strip()
