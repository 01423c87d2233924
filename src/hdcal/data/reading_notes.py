"""What is told of a case that was read, beside what was guessed of its file."""

from collections.abc import Container, Iterator

import numpy as np

from hdcal.data.case import Gear
from hdcal.data.loading import Motion
from hdcal.data.measurements import Measurements
from hdcal.data.mountings import TELLING
from hdcal.data.tables.cells import NOT_STATED
from hdcal.data.tables.headers import LABELS, parse_header
from hdcal.data.theory_names import SPRING
from hdcal.data.used_columns import ASSUMED, Columns
from hdcal.errors import quoted

MOST_ROWS = 8  # listed in one note
USUAL = -100.0, 500.0  # temperatures of rigs, heated and cooled ones [°C]
THIN = 0.1  # largest wall over radius of what textbooks call a thin-walled cylinder


def reading_notes(measured: Measurements, gear: Gear, motion: Motion) -> Iterator[str]:
    """Yield what is unusual of measurements, or was left out of them."""
    yield from _thick_wall(gear)
    yield from _unusual_temperature(measured)
    yield from unused_columns(measured.columns)
    yield from _off_scale(measured, gear)
    yield from _resets(measured, motion)
    if measured.mounted:
        runs, gears = (len(of.names) for of in (measured.run, measured.specimen))
        yield mountings_note(measured.columns.values, runs, gears)
    yield from _several_rigs(measured)


def mountings_note(told: Container[str], runs: int, gears: int) -> str:
    """Return by what mountings are told apart, where no column `run` tells them.

    Args:
        told: quantities, those that tell them among them.
        runs: how many mountings there are.
        gears: of how many gears.
    """
    telling = ", ".join(name for name in TELLING if name in told)
    telling = " or ".join(telling.rsplit(", ", 1))
    return (
        f"{ASSUMED}without a column `run`, rows of a gear that differ in {telling} are "
        f"of different mountings: {runs} mountings of {gears} gear{'s' * (gears > 1)}. "
        "If not, name the mountings in a column `run`"
    )


def _several_rigs(measured: Measurements) -> Iterator[str]:
    rigs = {*measured.columns.values.get("rig", ())} - {NOT_STATED}
    if len(measured.specimen.names) == 1 and len(rigs) > 1:
        yield (
            f"{len(rigs)} rigs read this gear, and a calibration or a diagnosis takes "
            "them for one: where their gains differ it sees a change of the gear. "
            "Leave the rows of one rig at a time; `hdcal fleet` tells rigs apart by "
            "the gears that several of them read"
        )


def _thick_wall(gear: Gear) -> Iterator[str]:
    size = gear.geometry
    share = float(size.wall_thickness / size.radius)
    if gear.theory != SPRING and share > THIN:
        yield (
            f"a wall of {size.wall_thickness:g} mm at a radius of {size.radius:g} mm "
            "is not thin, as the theories take it to be. Check both sizes, and units"
        )


def _unusual_temperature(measured: Measurements) -> Iterator[str]:
    found = measured.columns.values.get("temperature")
    if found is not None and not USUAL[0] <= np.median(found) <= USUAL[1]:
        yield (
            f"temperatures about {np.median(found):.4g} °C are far from those of any "
            "rig. Check the unit of the column"
        )


def unused_columns(columns: Columns) -> Iterator[str]:
    """Yield what of a file was not read."""
    positions = {column.position for column in columns.used.values()}
    quantities = {column.quantity for column in columns.used.values()}
    headers = [*enumerate(columns.table.headers)]
    extra = [header for place, header in headers if place not in positions and header]
    for header in extra:
        found = parse_header(header)
        named = found.quantity and found.quantity not in quantities
        if named and (found.quantity in LABELS or found.unit is None):
            label = found.quantity in LABELS
            why = "differs from row to row" if label else "names no unit"
            option = f"'{found.quantity}={header}{'' if label else '[UNIT]'}'"
            yield (
                f"{ASSUMED}{quoted(header)}, which may be the {found.quantity}, is not "
                f"used, as it {why}. Name the column to use it: --column {option}"
            )
    if extra:
        yield f"columns not used: {', '.join(map(quoted, extra))}"
    if skipped := columns.table.skipped:
        yield f"{skipped} empty lines between the readings were skipped"


def _off_scale(measured: Measurements, gear: Gear) -> Iterator[str]:
    step, force = gear.force_resolution, measured.columns.values["force"]
    if step:
        off = int((np.abs(force / step - np.round(force / step)) > 0.02).sum())
        if off:
            yield f"{off} of {force.size} forces are not multiples of {step:g} N"


def _resets(measured: Measurements, motion: Motion) -> Iterator[str]:
    if motion.resets:
        rows = [str(measured.columns.table.rows[row]) for row in motion.resets]
        more = ", …" if len(rows) > MOST_ROWS else ""
        yield (
            f"the deformation goes back over most of its range in one step (row "
            f"{', '.join(rows[:MOST_ROWS])}{more}), which counts as no measured "
            "unloading. Where a new mounting begins there, say so in a column `run`"
        )
