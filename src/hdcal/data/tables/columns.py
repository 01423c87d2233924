"""Choice of columns: which one is read as which quantity, in which unit.

Where several may be meant, or a unit is missing, that is asked; nothing is guessed.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from hdcal.data.findings import FileFindings
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.headers import (
    DIMENSIONS,
    GROUPINGS,
    LABELS,
    Header,
    parse_header,
    unit_advice,
    weight_unit,
)
from hdcal.data.tables.naming import check_names, places_named, split_brackets
from hdcal.data.units import Unit, find_unit
from hdcal.errors import quoted

REQUIRED = ("deformation", "force")
_TURNING = ("angle", "torque")  # of a torsional spring, in the same order
_SHOWN = 12  # columns that are listed where the user has to choose


@dataclass(frozen=True)
class Column:
    """A column that is used."""

    quantity: str
    header: str
    position: int  # 0 = first column
    unit: Unit | None = None  # None of labels
    guessed: bool = False  # its header is not spelt `quantity_unit`
    against: str = ""  # another unit, which its header names itself


def choose_columns(
    table: ReadTable,
    mapping: Mapping[str, str],
    quantities: Sequence[str],
    required: Sequence[str],
    findings: FileFindings,
) -> dict[str, Column]:
    """Return each quantity's column by its header, or as the user named it.

    Where deformation and force are required and the source holds torques and no forces,
    these are angle and torque. The mapping is from quantities to headers with the unit
    in square brackets, or to numbers of columns.
    """
    check_names(table, mapping, findings)
    chooser = _Chooser(table, findings)
    columns: dict[str, Column] = {}
    if {*REQUIRED} <= {*required}:
        turning = "force" not in mapping and (
            "torque" in mapping or chooser.is_torsion()
        )
        others = ("deformation", "force", "force_sd") if turning else ("torque",)
        for name in filter(mapping.__contains__, others):
            words = f"`columns` {name}=… does not belong to a test of "
            words += "torque and angle" if turning else "force and deformation"
            findings.add(
                words, "Name the columns of one kind of test", table.header_row
            )
        quantities = [name for name in quantities if name not in others]
        required = _TURNING if turning else required
    for quantity in quantities:
        if quantity in mapping:
            column = chooser.named(quantity, mapping[quantity])
        elif quantity in LABELS:
            column = chooser.label(quantity)
        else:
            column = chooser.measured(quantity, needed=quantity in required)
        if column is not None:
            columns[quantity] = column
    _refuse_conflicts(columns, table, findings)
    return columns


def in_place_of_force(used: Mapping[str, Column]) -> dict[str, Column]:
    """Return chosen columns with torque and angle in place of force and deformation."""
    if "torque" not in used:
        return dict(used)
    names = {"angle": "deformation", "torque": "force"}
    return {names.get(quantity, quantity): column for quantity, column in used.items()}


def as_named(table: ReadTable, used: Mapping[str, Column]) -> dict[str, str]:
    """Return the name of each column for `columns`, but for those of hdcal's files."""
    named = {}
    for column in used.values():
        quantity, header = column.quantity, parse_header(column.header)
        if header.exact and header.quantity == quantity and not column.against:
            continue
        alone = table.headers.count(column.header) == 1
        name = column.header if alone else str(column.position + 1)
        if column.unit is not None and not (alone and header.unit == column.unit):
            name = f"{name}[{column.unit.name}]"
        named[quantity] = name
    return named


class _Chooser:
    """Choice of one column after the other, with findings on what is wrong."""

    def __init__(self, table: ReadTable, findings: FileFindings):
        self._table, self._findings = table, findings
        self._headers = [*map(parse_header, table.headers)]

    def named(self, quantity: str, wanted: str) -> Column | None:
        """Return the column that a user named: 'Load [kN]', 'Load[kN]' or '2[kN]'."""
        headers = self._table.headers
        name, unit_text = split_brackets(wanted)
        places, option = places_named(wanted, headers), f"`columns` {quantity}="
        if len(places) != 1:
            near = get_close_matches(name, headers, 1, 0.4) or headers[:_SHOWN]
            words = f"{option}{wanted} names a column that does not exist"
            remedy = f"Use a header of the file: {', '.join(near)}"
            if places:
                words = f"{option}{wanted} matches {len(places)} columns"
                numbers = " or ".join(str(place + 1) for place in places)
                remedy = f"Name it by its number, {numbers}"
            self._findings.add(words, remedy, self._table.header_row, name)
            return None
        header, parsed = headers[places[0]], self._headers[places[0]]
        if quantity in LABELS:
            return Column(quantity, header, places[0])
        in_header = parsed.unit or find_unit(header.rpartition("_")[2])
        unit = in_header if unit_text is None else find_unit(unit_text)
        if unit is None or unit.dimension != DIMENSIONS[quantity]:
            text = parsed.unit_text if unit_text is None else unit_text
            words = f"unknown unit '{text}' for {quantity}"
            remedy = f"Write {option}'{name}[UNIT]'; {unit_advice(text, quantity)}"
            self._add(words, remedy, places[0])
            return None
        against = ""
        if in_header and in_header != unit and in_header.dimension == unit.dimension:
            against = in_header.name
        return Column(quantity, header, places[0], unit, against=against)

    def measured(self, quantity: str, *, needed: bool) -> Column | None:
        """Return the only column of a quantity; of several it is asked which is meant.

        One that is spelt `quantity_unit` is meant rather than others.
        """
        named = self._where(lambda h: h.quantity == quantity)
        exact = [place for place in named if self._headers[place].exact]
        named = exact or named
        fitting = [p for p in named if self._headers[p].measures(quantity)]
        if not (needed or exact):
            # One that names nothing else is meant rather than one that says more.
            chosen = [p for p in fitting if self._headers[p].whole] or fitting
            return self._column(quantity, chosen[0]) if len(chosen) == 1 else None
        # A gauge may be called by its serial number.
        nameless = self._where(
            lambda h: not h.quantity and not h.excluded and h.measures(quantity)
        )
        several = fitting if exact else sorted([*fitting, *nameless])
        if len(several) == 1 and fitting:
            return self._column(quantity, fitting[0])
        if several:
            self._ask_which(quantity, several)
        elif named:
            self._ask_unit(quantity, named[0])
        else:
            self._refuse_missing(quantity)
        return None

    def is_torsion(self) -> bool:
        """Tell whether a column holds a torque, and none a force."""

        def holds(name: str) -> bool:
            return bool(self._where(lambda h: h.quantity == name and h.measures(name)))

        return holds("torque") and not holds("force")

    def label(self, quantity: str) -> Column | None:
        """Return the only column of labels; which run or specimen is meant is asked."""
        places = self._label_places(quantity)
        if len(places) > 1 and quantity not in GROUPINGS:
            self._ask_which(quantity, places)
        return self._column(quantity, places[0]) if len(places) == 1 else None

    def _label_places(self, quantity: str) -> list[int]:
        """Return the places of the labels of a quantity, by headers and cells."""
        headers = self._headers
        named = [i for i, header in enumerate(headers) if header.quantity == quantity]
        if exact := [i for i in named if headers[i].exact]:
            return exact
        kinds: dict[bytes, int] = {}
        for place in [i for i in named if headers[i].whole] or named:
            index, texts = self._table.grid.labels(place)
            # A number for each reading is no label of a run or a gear; a run lasts.
            counted = quantity == "run" and bool((np.diff(index) != 0).all())
            if quantity not in GROUPINGS and (counted or len(texts) >= len(index)):
                continue
            # Of several that part the rows in the same way the first one is meant.
            kinds.setdefault(index.tobytes() if len(texts) > 1 else b"", place)
        return [place for kind, place in kinds.items() if kind] or [*kinds.values()]

    def _where(self, fits: Callable[[Header], bool]) -> list[int]:
        headers, empty = enumerate(self._headers), self._table.empty
        return [place for place, h in headers if place not in empty and fits(h)]

    def _column(self, quantity: str, place: int) -> Column:
        header = self._headers[place]
        unit = None if quantity in LABELS else header.unit
        text = self._table.headers[place]
        return Column(quantity, text, place, unit, guessed=not header.exact)

    def _add(self, problem: str, remedy: str, place: int) -> None:
        header = self._table.headers[place]
        self._findings.add(problem, remedy, self._table.header_row, header)

    def _ask_which(self, quantity: str, places: Sequence[int]) -> None:
        names = [quoted(self._table.headers[place]) for place in places]
        numbers = ", ".join(str(place + 1) for place in places)
        words = f"the {quantity} may be {' or '.join(names)}"
        if len(places) == 1:
            words = f"no header states the {quantity}; it may be {names[0]}"
        remedy = f"Name the column by its number ({numbers}): "
        remedy += f"`columns` '{quantity}={places[0] + 1}'"
        if len(places) > 1:
            remedy += ". If each is of another gear, put them below each other in one "
            remedy += "column, and its gear in another"
        self._add(words, remedy, places[min(1, len(places) - 1)])

    def _ask_unit(self, quantity: str, place: int) -> None:
        unit, text = self._headers[place].unit_text, self._table.headers[place]
        words = f"may be the {quantity}, but the header states no unit"
        if unit:
            words = f"unknown unit {quoted(unit)} of the {quantity}"
        name = text.removesuffix(f"[{unit}]").rstrip()
        weight = weight_unit(unit) if quantity == "force" else ""
        option = f"`columns` '{quantity}={name}[{weight or 'UNIT'}]'"
        self._add(words, f"State {option}; {unit_advice(unit, quantity)}", place)

    def _refuse_missing(self, quantity: str) -> None:
        """Add that no column holds a quantity, with one that might."""
        words, option = f"no column contains the {quantity}", f"`columns` '{quantity}="
        headers = self._table.headers
        shown = ", ".join(quoted(header) for header in headers[:_SHOWN] if header)
        remedy = f"State {option}HEADER[UNIT]'; the headers are {shown}"
        for place, header in enumerate(self._headers):
            unit = header.unit_text if header.measures(quantity) else ""
            if unit and place in self._table.empty:
                words += f"; {quoted(headers[place])} is empty"
                remedy = "Fill in the column; in a workbook save formulas as values"
                break
            if quantity == "force" and (weight := weight_unit(header.unit_text)):
                words += f"; {headers[place]} is a mass"
                unit = weight
            if unit:
                remedy = f"If {quoted(headers[place])} is it, state {option}"
                remedy += f"{place + 1}[{unit}]'"
                break
        self._findings.add(words, remedy, self._table.header_row, quantity)


def _refuse_conflicts(
    columns: Mapping[str, Column], table: ReadTable, findings: FileFindings
) -> None:
    """Add columns of two quantities, and units that differ from those of headers."""
    owners: dict[int, str] = {}
    for quantity, column in columns.items():
        other = owners.setdefault(column.position, quantity)
        if other != quantity:
            words = f"is used both as {other} and as {quantity}"
            remedy = "Name a different column for each quantity"
            findings.add(words, remedy, table.header_row, column.header)
        unit = table.conflicts.get(column.position)
        if unit and column.unit is not None and not column.against:
            words = f"{quoted(column.header)} states {column.unit.name}, but the row "
            words += f"of units {unit}"
            findings.add(words, "Remove the wrong one", table.unit_row)
