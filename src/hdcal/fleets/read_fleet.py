"""Read what was measured on many gears, in whatever form it comes."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from hdcal.data.case import Case
from hdcal.data.gear_files import gear_files
from hdcal.data.gear_folder import read_gear_folder
from hdcal.data.parquet import read_parquet
from hdcal.data.reading import read_case
from hdcal.data.tables.parquet_files import is_parquet
from hdcal.errors import Finding, InputError
from hdcal.fleets.pool import pool_of
from hdcal.fleets.readings import FleetReadings, fleet_readings


def read_fleet(
    data: Any,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    theory: str | None = None,
    reading: str | None = None,
    encoding: str | None = None,
    scheduler: str | None = None,
    skip_bad: bool = False,
    range: str | None = None,
) -> FleetReadings:
    """Return what was measured on a fleet.

    Args:
        data: a case; a file, folder or table in memory as `read_case` takes it; a
            folder with a file or a case for each gear; a Parquet file, or a folder of
            them, which are read in batches.
        gear: as in `read_case`; a case has its own.
        columns: likewise.
        theory: likewise.
        reading: likewise.
        encoding: likewise; of no Parquet.
        scheduler: address of a Dask scheduler, whose workers read the files of a
            Parquet folder.
        skip_bad: leave out gears of which a row is wrong, whole.
        range: working range, as in `read_case`; not of Parquet, which is not screened.

    Raises:
        InputError: holds everything that is wrong with the data.
    """
    if isinstance(data, FleetReadings):
        return data
    how: dict = {"columns": columns, "theory": theory, "reading": reading}
    how |= {"skip_bad": skip_bad}
    if is_parquet(data) and range is not None:
        words = "is not known of Parquet, which is read in batches"
        raise InputError([Finding("range", words, "Save the rows that are meant")])
    if is_parquet(data):
        source = read_parquet(data, gear, **how)
        return pool_of(source, scheduler, skip_bad=skip_bad).readings(source)
    if scheduler is not None:
        words = "is no Parquet, which alone is read by several"
        remedy = "Leave it out, or save the data as Parquet files"
        raise InputError([Finding("scheduler", f"the data {words}", remedy)])
    if isinstance(data, Case):
        return fleet_readings(data)
    how |= {"encoding": encoding, "range": range}
    if gear_files(data):
        case, sizes = read_gear_folder(data, gear, **how)
        # A gear that is bad in one file may stand in others.
        return replace(fleet_readings(case), sizes=sizes).without(case.left_out)
    return fleet_readings(read_case(data, gear, **how))
