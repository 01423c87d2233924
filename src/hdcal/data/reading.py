"""Read one case: a table of measurements and the gear it was taken on."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hdcal.data.case import Case, Gear
from hdcal.data.gear import read_gear
from hdcal.data.loading import derive_motion
from hdcal.data.records import Records
from hdcal.data.table import Table, read_csv
from hdcal.errors import Finding, InputError

DATA_NAME, GEAR_NAME = "data.csv", "gear.toml"
MANY = 3  # labels from which a spread between runs or specimens can be estimated


def read_case(
    data: Path | str,
    gear: Path | str | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    theory: str | None = None,
) -> Case:
    """Read a case from a CSV file or from a folder.

    Args:
        data: a CSV file, or a folder holding data.csv and gear.toml.
        gear: a gear file; by default the gear.toml beside the data.
        columns: quantity -> header with its unit in brackets, `{"force": "Load[kgf]"}`.
        theory: overrides the gear file's theory.

    Raises:
        InputError: holds everything that is wrong with either file.
    """
    data = Path(data)
    folder = data.is_dir()
    csv_path = data / DATA_NAME if folder else data
    gear_path = Path(gear) if gear is not None else csv_path.parent / GEAR_NAME
    findings: list[Finding] = []
    table = found = None
    try:
        table = read_csv(csv_path, columns)
    except InputError as error:
        findings += error.findings
    try:
        if gear is None and not gear_path.exists():
            raise InputError([_no_gear(data)])
        found = read_gear(gear_path, theory)
    except InputError as error:
        findings += error.findings
    if table is not None and found is not None:
        findings += _too_far(table, found, str(csv_path))
    if findings or table is None or found is None:
        raise InputError(findings)
    return Case(
        name=(data.resolve().name if folder else data.stem) or "case",
        gear=found,
        records=_records(table, found),
        run_labels=table.run_labels,
        specimen_labels=table.specimen_labels,
        data_sha256=table.sha256,
        notes=table.notes + _off_scale(table.values["force"], found),
    )


def _records(table: Table, gear: Gear) -> Records:
    values, size = table.values, len(table.rows)
    zeros = np.zeros(size)
    motion = derive_motion(values["deformation"], table.run, values.get("time"))
    # NumPy arrays: JAX takes them when it computes, and reading starts no device
    fields: dict[str, Any] = dict(
        deformation=values["deformation"],
        temperature=values.get("temperature", zeros + gear.reference_temperature),
        time=values.get("time", zeros),
        angle=values.get("angle", zeros),
        direction=motion.direction,
        sense=motion.sense,
        rate=motion.rate,
        run=table.run,
        specimen=table.specimen,
        force=values["force"],
        force_sd=values.get("force_sd", zeros),
    )
    return Records(**fields, known=motion.features | _measured(table))


def _measured(table: Table) -> frozenset[str]:
    columns = ("temperature", "time", "angle", "force_sd")
    known = {name for name in columns if name in table.values}
    if "force_sd" in known and not table.values["force_sd"].any():
        known.remove("force_sd")  # a column of zeros says that nothing is known
    for name, labels in (
        ("run", table.run_labels),
        ("specimen", table.specimen_labels),
    ):
        if len(labels) > 1:
            known.add(name)
        if len(labels) >= MANY:
            known.add(name + "s")
    return frozenset(known)


def _too_far(table: Table, gear: Gear, file: str) -> list[Finding]:
    limit = float(gear.geometry.radius) * (2 if gear.reading == "diametral" else 1)
    size = np.abs(table.values["deformation"])
    if size.max() < limit:
        return []
    words = (
        f"a deformation of {size.max():g} mm on a radius of {gear.geometry.radius:g} mm"
    )
    remedy = "Check the unit of the column and the radius in the gear file"
    row = int(table.rows[int(size.argmax())])
    return [Finding(file, words, remedy, row, table.headers["deformation"])]


def _off_scale(force: np.ndarray, gear: Gear) -> tuple[str, ...]:
    step = gear.force_resolution
    if not step:
        return ()
    counts = force / step
    off = int((np.abs(counts - np.round(counts)) > 0.02).sum())
    if not off:
        return ()
    return (f"{off} of {force.size} forces are not multiples of {step:g} N",)


def _no_gear(data: Path) -> Finding:
    words = "no gear file was named, and there is no gear.toml beside the data"
    remedy = "Say --gear FILE.toml, or use a folder with data.csv and gear.toml"
    return Finding(str(data), words, remedy)
