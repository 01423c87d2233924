"""The cells in which a gap is looked for, declared before the data are seen."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from hdcal.data.loading import movement_words
from hdcal.data.records import Array, Records
from hdcal.quantities import FORCE, Quantities

# A mean of fewer rows says little.
_FEWEST = 3
_MOST_LEVELS = 8


@dataclass(frozen=True)
class DeclaredCell:
    """One cell: which rows are in it.

    Attributes:
        covariate: what divides the rows.
        label: for people.
        start: lower end in `unit`, NaN for labels.
        stop: upper end, NaN for labels.
        unit: of the covariate.
        rows: which are inside, shape (n,).
    """

    covariate: str
    label: str
    start: float
    stop: float
    unit: str
    rows: Float[Array, " n"]


def declare_cells(
    records: Records,
    run_labels: tuple[str, ...] = (),
    specimen_labels: tuple[str, ...] = (),
    units: Quantities = FORCE,
) -> list[DeclaredCell]:
    """Divide the rows by every covariate that was measured, and by pairs of them.

    Args:
        records: rows in any order.
        run_labels: of each run index.
        specimen_labels: of each specimen index.
        units: names and units of what was measured.
    """
    unit = units.displacement_unit
    by_deformation = _parts("deformation", records.deformation, unit, 3)
    found = _parts("deformation", records.deformation, unit, 3)
    other: list[DeclaredCell] = []
    if "temperature" in records.known:
        other += _levels("temperature", records.temperature, "°C")
    if "unloading" in records.known:
        other += _directions(records, units)
    runs = _labels("run", records.run, run_labels)
    alone = list(other)
    if "time" in records.known:
        alone += _parts("time", records.time, "s", 6)
    if "angle" in records.known:
        alone += _parts("angle", np.mod(records.angle, 2.0 * np.pi), "rad", 6)
    alone += _labels("specimen", records.specimen, specimen_labels) + runs
    both = [_cross(a, b) for a in [*other, *runs] for b in by_deformation]
    return [cell for cell in [*found, *alone, *both] if _useful(cell)]


def _useful(cell: DeclaredCell) -> bool:
    inside = np.count_nonzero(cell.rows)
    return bool(_FEWEST <= inside <= len(cell.rows) - _FEWEST)


def _number(value: float) -> str:
    return f"{value:.3g}"


def _parts(name: str, values, unit: str, count: int) -> list[DeclaredCell]:
    values = np.asarray(values, float)
    edges = np.linspace(values.min(), values.max(), count + 1)
    if edges[0] == edges[-1]:
        return []
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, count - 1)
    return [
        DeclaredCell(
            name,
            f"{_number(low)} … {_number(high)} {unit}",
            float(low),
            float(high),
            unit,
            (place == index).astype(float),
        )
        for index, (low, high) in enumerate(pairwise(edges))
    ]


def _levels(name: str, values, unit: str) -> list[DeclaredCell]:
    values = np.asarray(values, float)
    rounded = np.round(values)
    levels = np.unique(rounded)
    if len(levels) < 2:
        return []
    if len(levels) > _MOST_LEVELS:
        return _parts(name, values, unit, 3)
    return [
        DeclaredCell(
            name,
            f"{level:.0f} {unit}",
            float(level),
            float(level),
            unit,
            (rounded == level).astype(float),
        )
        for level in levels
    ]


def _directions(records: Records, units: Quantities) -> list[DeclaredCell]:
    words = movement_words(np.asarray(records.deformation), units.displacement)
    return [
        DeclaredCell(
            "direction",
            words[sense],
            np.nan,
            np.nan,
            "",
            (np.asarray(records.sense) == sense).astype(float),
        )
        for sense in (1, -1)
    ]


def _labels(name: str, index, labels: tuple[str, ...]) -> list[DeclaredCell]:
    members = np.unique(index)
    if not 1 < len(members) <= 12:
        return []
    return [
        DeclaredCell(
            name,
            f"{name} {labels[member] if member < len(labels) else member}",
            np.nan,
            np.nan,
            "",
            (np.asarray(index) == member).astype(float),
        )
        for member in members
    ]


def _cross(one: DeclaredCell, other: DeclaredCell) -> DeclaredCell:
    return DeclaredCell(
        f"{one.covariate} × {other.covariate}",
        f"{one.label}, {other.label}",
        other.start,
        other.stop,
        other.unit,
        one.rows * other.rows,
    )
