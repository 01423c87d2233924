"""Notes on a case that was read: what was assumed, and what is unusual."""

from collections.abc import Container, Iterator, Mapping, Sequence

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.loading import Motion
from hdcal.data.measurements.labels import TELLING
from hdcal.data.records import OF_POSITIONS
from hdcal.data.tables.blocks import ReadTable
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.tables.columns import Column
from hdcal.data.tables.headers import LABELS, parse_header
from hdcal.data.theory_names import SPRING
from hdcal.errors import quoted, shortened
from hdcal.quantities import Quantities

ASSUMED = "ASSUMED: "  # first word of a note on what was assumed
_MOST_ROWS = 8  # listed in one note
_USUAL = -100.0, 500.0  # temperatures of rigs, heated and cooled ones [°C]
_THIN = 0.1  # largest wall over radius that textbooks call a thin-walled cylinder


def source_notes(
    table: ReadTable, used: Mapping[str, Column], others: Sequence[str] = ()
) -> list[str]:
    """Return what was assumed of a source, other notes, and what of it is not used."""
    notes = [f"{ASSUMED}{note}" for note in table.notes]
    notes += [
        f"{ASSUMED}{quoted(column.header)} is in {column.unit.name}, as requested, "
        f"although its header states {column.against}"
        for column in used.values()
        if column.against and column.unit is not None
    ]
    guesses = [column for column in used.values() if column.guessed]
    if guesses:
        meanings = ", ".join(map(_meaning, guesses))
        form = "HEADER" if guesses[0].unit is None else "HEADER[UNIT]"
        option = f"--column '{guesses[0].quantity}={form}'"
        notes.append(f"{ASSUMED}{meanings}. If not, name the column: {option}")
    positions = {column.position for column in used.values()}
    extra = [h for place, h in enumerate(table.headers) if place not in positions and h]
    known = {column.quantity for column in used.values()}
    notes += [note for header in extra for note in _likely(header, known)]
    notes += [*table.left_out, *others]
    if extra:
        notes.append(f"columns not used: {', '.join(map(quoted, extra))}")
    return notes


def _likely(header: str, known: Container[str]) -> Iterator[str]:
    """Yield that a column that is not used may hold a quantity that is not known."""
    meant = parse_header(header)
    label = meant.quantity in LABELS
    if meant.quantity and meant.quantity not in known and (label or not meant.unit):
        why = "differs from row to row" if label else "has no unit"
        option = f"'{meant.quantity}={header}{'' if label else '[UNIT]'}'"
        yield (
            f"{ASSUMED}{quoted(header)}, which may be the {meant.quantity}, is not "
            f"used, as it {why}. Name the column to use it: --column {option}"
        )


def _meaning(column: Column) -> str:
    unit = "" if column.unit is None else f" in {column.unit.name}"
    return f"{quoted(column.header)} is the {column.quantity}{unit}"


def gear_notes(
    gear: Gear, force: np.ndarray, temperature: np.ndarray | None
) -> Iterator[str]:
    """Yield what is unusual of a gear, its forces [N] and temperatures [°C], (n,)."""
    size, step = gear.geometry, gear.force_resolution
    if gear.theory != SPRING and float(size.wall_thickness / size.radius) > _THIN:
        yield (
            f"a wall of {size.wall_thickness:g} mm at a radius of {size.radius:g} mm "
            "is not thin, as the theories assume. Check both sizes and their units"
        )
    if step:
        off = int((np.abs(force / step - np.round(force / step)) > 0.02).sum())
        if off:
            yield (
                f"{off} of {force.size} forces are not multiples of the stated "
                f"resolution of {step:g} N"
            )
    low, high = _USUAL
    if temperature is not None and not low <= np.median(temperature) <= high:
        yield (
            f"a median temperature of {np.median(temperature):.4g} °C is not "
            "plausible. Check the unit of the column"
        )


def positions_note(
    gear: Gear, deformation: np.ndarray, units: Quantities
) -> Iterator[str]:
    """Yield where a part is unloaded whose deformation is read as a position, (n,)."""
    if gear.priors["deformation_offset"].source == OF_POSITIONS:
        low, high = float(np.min(deformation)), float(np.max(deformation))
        unit = units.displacement_unit
        yield (
            f"{ASSUMED}the {units.displacement} is a position, {low:.6g} to {high:.6g} "
            f"{unit}. The part is unloaded at {gear.contact:.6g} {unit}, where a "
            f"straight line through the readings has no {units.load}. If not, state "
            "the prior of deformation_offset in a gear file"
        )


def resets_note(motion: Motion, rows: np.ndarray, units: Quantities) -> Iterator[str]:
    """Yield that the deformation was reset; rows are the names of rows, shape (n,)."""
    if motion.resets:
        few = shortened(rows[[*motion.resets]].tolist(), _MOST_ROWS)
        yield (
            f"the {units.displacement} returns over most of its range in one step "
            f"(row {few}), which is not taken for unloading. If a new mounting begins "
            "there, label it in a column `run`"
        )


def mountings_note(stated: Container[str], runs: int, gears: int) -> Iterator[str]:
    """Yield what distinguishes mountings, where no column `run` does that."""
    telling = [name for name in TELLING if name in stated]
    if "run" not in stated and runs > gears and telling:
        yield (
            f"{ASSUMED}without a column `run`, rows of a gear that differ in "
            f"{' or '.join(telling)} belong to different mountings: {runs} mountings "
            f"of {gears} gear{'s' if gears > 1 else ''}. If not, label the mountings "
            "in a column `run`"
        )


def rigs_note(rigs: Sequence[str], gears: int) -> Iterator[str]:
    """Yield that several rigs, of all rows or runs, read one gear."""
    many = len({*rigs} - {NOT_STATED})
    if gears == 1 and many > 1:
        yield (
            f"this gear was measured on {many} rigs, which a calibration or a "
            "diagnosis treats as one: a difference of their gains appears as a change "
            "of the gear. Give the rows of one rig at a time, or use `hdcal fleet`"
        )
