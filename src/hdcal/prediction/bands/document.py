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
    force, at = bands.physics_median_N, bands.deformation_mm
    if len(force) == 1:
        ends = {"median": force, "lo": bands.physics_lo_N, "hi": bands.physics_hi_N}
        middle, span = estimate({name: end.item() for name, end in ends.items()})
        return (
            f"At {at.item():g} mm the mean force is {middle} N, {100 * interval:g} % "
            f"credible interval {span} N."
        )
    return (
        f"From {at.min():g} to {at.max():g} mm the mean force lies between "
        f"{number(force.min())} and {number(force.max())} N."
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
        f"mm, {cold:g} … {warm:g} °C, {seen}"
    )


def bands_document(bands: Bands) -> Document:
    """Return bands as a table for a notebook."""
    size = len(bands.tested)
    numbers = ("deformation [mm]", "temperature [°C]", "mean [N]", "band of the mean")
    numbers += ("band of a new reading",)
    rows = [_row(bands, row) for row in range(min(size, _MOST_ROWS))]
    columns = [*numbers[:2], "direction", *numbers[2:], "tested"]
    more = [Text(f"The first {_MOST_ROWS} of {size}.")] if size > _MOST_ROWS else []
    unusable = () if bands.usable.all() else ("the calibration failed its checks",)
    return Document(
        name="Bands",
        kind="bands",
        subtitle="force as read",
        headline=f"The force at {size} places, with its bands.",
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
