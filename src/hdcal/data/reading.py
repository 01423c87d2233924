"""Read one case: a table of measurements and the gear it was taken on."""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.gear import read_gear
from hdcal.data.measurements.case_of import case_of
from hdcal.data.measurements.gear_files import DATA_NAME, GEAR_NAME, file_of_gear
from hdcal.data.measurements.measurements import of_specimen, read_measurements
from hdcal.data.measurements.notes import ASSUMED
from hdcal.data.measurements.screened import asked_range
from hdcal.data.tables.sources import IN_MEMORY, is_frame
from hdcal.data.theory_names import SPRING
from hdcal.errors import Finding, Findings, InputError

_NO_NAME = re.compile(r'[\\/:?"<>|]+')
_NEARBY = f"the gear file is the {GEAR_NAME} next to the data"
# The note where no gear file was named, and none lies next to the data.
UNSIZED = (
    f"{ASSUMED}without a gear file the part is treated as a spring: the result is its "
    "stiffness, without K. For K state the sizes in a gear file: "
    f"{GEAR_NAME} in the folder of the data, or --gear FILE.toml"
)

_WARMTH = (
    f"{ASSUMED}without a gear file the stiffness is stated at the mean temperature of "
    "the readings, {:g} °C. For another temperature state reference_temperature_C "
    "in a gear file"
)


def read_case(
    data: Any,
    gear: Path | str | Mapping[str, Any] | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    encoding: str | None = None,
    sheet: str | None = None,
    specimen: str | None = None,
    skip_bad: bool | None = None,
    range: str | None = None,
) -> Case:
    """Read a case from a file, a folder or a table in memory.

    Args:
        data: a CSV file, workbook (.xlsx) or Parquet file, a folder holding data.csv
            and gear.toml, or a DataFrame, or arrays by header.
        gear: a gear file, or its content as a mapping, as in
            `{"wall_thickness_mm": 0.68, "radius_mm": 40.0, "length_mm": 70.0}`; by
            default the gear.toml next to the data, and without one a spring of which
            only the stiffness is asked.
        columns: quantity -> header with its unit in brackets, `{"force": "Load[kgf]"}`,
            or the number of its column, `{"force": "2[kN]"}`; they stand for those of
            the gear file's table [columns].
        encoding: encoding of a CSV file; by default the likeliest.
        sheet: sheet of a workbook; by default the one with readings.
        specimen: label of the only one that is read; by default all of them.
        skip_bad: leave out specimens with a faulty row, whole; `left_out` of the
            case names them. False: refuse, and say that this can be asked for.
        range: working range; rows outside it are left out: `0.1:0.6` of the
            deformation as read [mm] or the angle [rad], `10%:40%` of the largest force
            of each run, or `straight` for the longest straight part; by default that of
            the gear file, or `all` that was read until the force drops for good.

    Raises:
        InputError: holds everything that is wrong with either file.
    """
    columns, in_memory = asked_columns(data, columns)
    asked_range(range)
    path = Path(IN_MEMORY if in_memory else data)
    # Of a folder with a file for each gear, the one that is called after it.
    own = path if in_memory else file_of_gear(path, specimen)
    # As `is_dir`, but a path that no system takes is no folder.
    folder = not in_memory and os.path.isdir(own)
    table = data if in_memory else (own / DATA_NAME if folder else own)
    with Findings() as wrong:
        # The gear file may name the columns; what is wrong with it comes second.
        of_gear = Findings()
        nearby = None if in_memory else Path(table).parent / GEAR_NAME
        described = of_gear.attempt(gear_of, gear, nearby, folder)
        known = None if described is None else described[0]
        named = columns if known is None else known.source.get("columns", {}) | columns
        how: dict = {"sheet": sheet, "gear": known, "skip_bad": skip_bad}
        measured = wrong.attempt(read_measurements, table, named, encoding, **how)
        wrong += of_gear
        alone = own != path and measured is not None and len(measured.gears[1]) == 1
        if measured is not None and specimen is not None and not alone:
            measured = wrong.attempt(of_specimen, measured, str(specimen))
    assert measured is not None and described is not None
    label = None if own != path else specimen
    name = _name(own, folder, sheet, label)
    described = unsized(*described, measured.get("temperature", ()))
    return case_of(measured, *described, name, range, skip_bad)


def asked_columns(
    data: Any, columns: Mapping[str, str] | None
) -> tuple[dict[str, str], bool]:
    """Return columns as texts, and whether the data are a table in memory."""
    if columns is not None and not isinstance(columns, Mapping):
        remedy = "Name quantities and headers, as {'force': 'Load[kN]'}"
        raise InputError([Finding("columns", "is not a mapping", remedy)])
    if not is_frame(data) and not isinstance(data, str | os.PathLike):
        remedy = "Give a path, a DataFrame, or arrays by header as {'force_N': …}"
        raise InputError([Finding("data", f"is a {type(data).__name__}", remedy)])
    named = {str(name): str(header) for name, header in (columns or {}).items()}
    return named, is_frame(data)


def _name(data: Path, folder: bool, *parts: str | None) -> str:
    name = (data.resolve().name if folder else data.stem) or "case"
    texts = (str(part).strip() for part in parts if part is not None)
    return "-".join([name, *(_NO_NAME.sub("_", text) for text in texts)])


def gear_of(
    gear: Path | str | Mapping[str, Any] | None,
    nearby: Path | None,
    folder: bool,
) -> tuple[Gear, tuple[str, ...]]:
    """Return the gear of a case, and notes; a folder must hold the file `nearby`."""
    notes = []
    if gear is None and nearby is not None and (folder or os.path.exists(nearby)):
        gear = nearby
        notes += [] if folder else [_NEARBY]
    if gear is not None:
        known = read_gear(gear)
        return known, (*_defaults(known), *notes)
    return read_gear({"name": "part", "theory": SPRING}), (UNSIZED,)


def unsized(
    gear: Gear, notes: tuple[str, ...], temperature: Sequence[float] | np.ndarray
) -> tuple[Gear, tuple[str, ...]]:
    """Return what `gear_of` returned; without a gear file as warm as its readings.

    The temperature is that of the readings [°C], shape (n,); empty if not measured.
    """
    if UNSIZED not in notes or not len(temperature):
        return gear, notes
    warm = round(float(np.mean(temperature)), 1)
    return replace(gear, reference_temperature=warm), (*notes, _WARMTH.format(warm))


def _defaults(gear: Gear) -> Iterator[str]:
    """Yield defaults that the gear file leaves and on which much depends."""
    if gear.theory == SPRING:
        return
    if "deformation" not in gear.source.get("measurement", {}):
        yield (
            f"{ASSUMED}the deformation is radial. If it is diametral, which makes K "
            "twice as large, state it in the gear file"
        )
    if "material" not in gear.source.get("gear", {}):
        yield (
            f"{ASSUMED}the gear is of steel. If not, state its material in the gear "
            "file: it changes K and the influence of the temperature"
        )
