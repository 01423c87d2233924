"""Bands in words."""

from hdcal.data.records import Records
from hdcal.prediction.bands.bands import Bands
from hdcal.report.document import Document, Section, Table, Tag, Text
from hdcal.report.intervals import Interval
from hdcal.report.words import estimate, number

# Rows of a table; all are in the columns.
_MOST_ROWS = 40


def headline(bands: Bands, interval: float) -> str:
    """Return which forces were predicted, in one sentence."""
    force, at, units = bands.physics_median_N, bands.deformation_mm, bands.units
    unit = units.load_unit
    if len(force) == 1:
        ends = {"median": force, "lo": bands.physics_lo_N, "hi": bands.physics_hi_N}
        middle, span = estimate({name: end.item() for name, end in ends.items()})
        return (
            f"At {at.item():g} {units.displacement_unit} the mean {units.load} is "
            f"{middle} {unit}, {100 * interval:g} % credible interval {span} {unit}."
        )
    return (
        f"From {at.min():g} to {at.max():g} {units.displacement_unit} the mean "
        f"{units.load} lies between {number(force.min())} and {number(force.max())} "
        f"{unit}."
    )


def next_step(bands: Bands) -> str | None:
    """Return what to do about rows that were not tested."""
    if bands.tested.all():
        return None
    return "Measure there too where a row says that it was not tested."


def untested_rows(bands: Bands, records: Records) -> str:
    """Say how many rows were not tested, and what was; empty if all were."""
    untested, size = int((~bands.tested).sum()), len(bands.tested)
    if not untested:
        return ""
    low, high = records.deformation.min(), records.deformation.max()
    cold, warm = records.temperature.min(), records.temperature.max()
    ways = {1.0: "up", -1.0: "down"}
    seen = " and ".join(way for sense, way in ways.items() if sense in records.sense)
    return (
        f"{untested} of {size} rows lie outside what was tested: {low:g} … {high:g} "
        f"{bands.units.displacement_unit}, {cold:g} … {warm:g} °C, {seen}"
    )


def bands_document(bands: Bands) -> Document:
    """Return bands as a table for a notebook."""
    size, units = len(bands.tested), bands.units
    along = f"{units.displacement} [{units.displacement_unit}]"
    numbers = (along, "temperature [°C]", f"mean [{units.load_unit}]")
    numbers += ("band of the mean", "band of a new reading")
    rows = [_row(bands, row) for row in range(min(size, _MOST_ROWS))]
    columns = [*numbers[:2], "direction", *numbers[2:], "tested"]
    more = [Text(f"The first {_MOST_ROWS} of {size}.")] if size > _MOST_ROWS else []
    unusable = () if bands.usable.all() else ("the calibration failed its checks",)
    return Document(
        name="Bands",
        kind="bands",
        subtitle=f"{units.load} as read",
        headline=f"The {units.load} at {size} places, with its bands.",
        sections=[
            Section("Bands", [Table(columns, rows, frozenset(numbers)), *more], True)
        ],
        failed=unusable,
    )


def _row(bands: Bands, row: int) -> list[str | Tag]:
    def ends(band: str) -> Interval:
        parts = (
            getattr(bands, f"{band}_{end}_N")[row] for end in ("median", "lo", "hi")
        )
        return Interval(*map(float, parts))

    return [
        f"{bands.deformation_mm[row]:g}",
        f"{bands.temperature_C[row]:g}",
        str(bands.direction[row]),
        *estimate(ends("physics")),
        estimate(ends("new_measurement"))[1],
        "yes" if bands.tested[row] else Tag("extrapolated", "caution"),
    ]
