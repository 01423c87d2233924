"""Which column of a table is which quantity, and in which unit."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from hdcal.data.units import COLUMN_UNITS, known_unit
from hdcal.errors import Finding

LABELS = ("run", "specimen")
QUANTITIES = (*COLUMN_UNITS, *LABELS)
REQUIRED = ("deformation", "force")

_BRACKETS = re.compile(r"(?P<header>.*?)\s*\[\s*(?P<unit>[^\[\]]*?)\s*\]")


@dataclass(frozen=True)
class Column:
    """One column that is used.

    Attributes:
        quantity: one of QUANTITIES.
        header: as written in the file.
        position: 0 = first column.
        unit: one of COLUMN_UNITS[quantity]; empty for labels.
    """

    quantity: str
    header: str
    position: int
    unit: str = ""


def match_columns(
    headers: Sequence[str],
    mapping: Mapping[str, str],
    file: str,
    row: int = 1,
    *,
    quantities: Sequence[str] = QUANTITIES,
    required: Sequence[str] = REQUIRED,
) -> tuple[dict[str, Column], list[Finding]]:
    """Find each quantity's column by its name, or by what the user said.

    Args:
        headers: of the file, stripped.
        mapping: quantity -> header with the unit in square brackets.
        file: how the user named the file.
        row: line of the headers.
        quantities: what to look for.
        required: which of them must be there.

    Returns:
        The columns by quantity, and what is wrong with the headers.
    """
    columns: dict[str, Column] = {}
    findings: list[Finding] = []
    for quantity in mapping:
        if quantity not in QUANTITIES:
            findings.append(_unknown_quantity(quantity, file))
    for quantity in quantities:
        if quantity in mapping:
            found = _mapped(quantity, mapping[quantity], headers, file, row)
        else:
            found = _named(quantity, headers, file, row)
            if found is None and quantity in required:
                found = _missing(quantity, headers, file, row)
        if isinstance(found, Column):
            columns[quantity] = found
        elif found is not None:
            findings.append(found)
    return columns, findings + _shared(columns, file, row)


def _named(
    quantity: str, headers: Sequence[str], file: str, row: int
) -> Column | Finding | None:
    good: list[Column] = []
    bad: list[tuple[str, str]] = []
    for position, header in enumerate(headers):
        name, unit = _split(header)
        if name != quantity:
            continue
        known = unit if quantity in LABELS else known_unit(quantity, unit)
        if (quantity in LABELS and unit == "") or (quantity not in LABELS and known):
            good.append(Column(quantity, header, position, known or ""))
        elif quantity not in LABELS:
            bad.append((header, unit))
    if len(good) > 1:
        names = " and ".join(f"'{column.header}'" for column in good)
        words = f"two columns hold the {quantity}: {names}"
        return Finding(file, words, "Keep one of them", row, good[1].header)
    if good:
        return good[0]
    if bad:
        return _bad_unit(quantity, *bad[0], file, row)
    return None


def _mapped(
    quantity: str, wanted: str, headers: Sequence[str], file: str, row: int
) -> Column | Finding:
    match = _BRACKETS.fullmatch(wanted.strip())
    name, unit = (match["header"], match["unit"]) if match else (wanted.strip(), "")
    # a header may itself end in brackets, so the whole text is tried as well
    wholes = {_squeezed(wanted), _squeezed(name)}
    hits = [i for i, header in enumerate(headers) if _squeezed(header) in wholes]
    option = f"--column {quantity}="
    if not hits:
        near = get_close_matches(name, headers, 1, 0.4)
        remedy = f"Use a header of the file, such as '{near[0]}'" if near else ""
        remedy = remedy or "Use one of: " + ", ".join(headers[:20])
        words = f"{option}{wanted} names a column that is not there"
        return Finding(file, words, remedy, row, name)
    if len(hits) > 1:
        words = f"{option}{wanted} fits {len(hits)} columns"
        return Finding(file, words, "Give the columns different headers", row, name)
    header = headers[hits[0]]
    if quantity in LABELS:
        return Column(quantity, header, hits[0])
    if not unit and "_" in header:
        unit = header.rpartition("_")[2]
    known = known_unit(quantity, unit)
    if known is None:
        units = ", ".join(COLUMN_UNITS[quantity])
        words = f"has no unit that is known for {quantity}"
        if match:
            words = f"unknown unit '{unit}' for {quantity}"
        remedy = f"Write {option}'{name}[UNIT]' with one of: {units}"
        return Finding(file, words, remedy, row, header)
    return Column(quantity, header, hits[0], known)


def _split(header: str) -> tuple[str, str]:
    """`force_sd_N` -> (`force_sd`, `N`); ('', '') when it names no quantity."""
    lowered = header.lower()
    for quantity in sorted(QUANTITIES, key=len, reverse=True):
        if lowered == quantity or lowered.startswith(quantity + "_"):
            return quantity, header[len(quantity) + 1 :]
    return "", ""


def _squeezed(text: str) -> str:
    return "".join(text.split())


def _bad_unit(quantity: str, header: str, unit: str, file: str, row: int) -> Finding:
    units = COLUMN_UNITS[quantity]
    problem = f"unknown unit '{unit}'" if unit else "the header names no unit"
    remedy = f"Name it {quantity}_UNIT with one of: {', '.join(units)}"
    near = [known for known in units if known.lower() == unit.lower()]
    if near:
        remedy += f" (did you mean {near[0]}?)"
    return Finding(file, problem, remedy, row, header)


def _missing(quantity: str, headers: Sequence[str], file: str, row: int) -> Finding:
    example = f"{quantity}_{COLUMN_UNITS[quantity][0]}"
    near = [header for header in headers if quantity in header.lower()]
    near += get_close_matches(example, headers, 1, 0.6)
    named = near[0] if near else "HEADER"
    unit = "" if _BRACKETS.fullmatch(named) else "[UNIT]"
    remedy = f"Name it like {example}, or say --column '{quantity}={named}{unit}'"
    return Finding(file, f"no column holds the {quantity}", remedy, row, quantity)


def _shared(columns: dict[str, Column], file: str, row: int) -> list[Finding]:
    owners: dict[int, str] = {}
    findings = []
    for quantity, column in columns.items():
        other = owners.setdefault(column.position, quantity)
        if other != quantity:
            words = f"is used both as {other} and as {quantity}"
            remedy = "Give each quantity a column of its own"
            findings.append(Finding(file, words, remedy, row, column.header))
    return findings


def _unknown_quantity(quantity: str, file: str) -> Finding:
    near = get_close_matches(quantity, QUANTITIES, 1, 0.5)
    hint = f"Did you mean {near[0]}? " if near else ""
    words = f"--column {quantity}=… names no quantity that hdcal knows"
    return Finding(file, words, f"{hint}Known are: {', '.join(QUANTITIES)}")
