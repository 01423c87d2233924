"""Records of simulated springs, as files with known answers."""

from pathlib import Path

import numpy as np

from benchmarks.springs.faults import OF_PART, OF_RIG, STARTS
from benchmarks.springs.spring import Spring, straight_spring

ALL = {fault.__name__: fault for fault in (*OF_PART, *OF_RIG)}


def faulty_spring(
    rng: np.random.Generator, names: list[str] | None = None, like: int = 2
) -> Spring:
    """Return a spring with some faults, its readings as a rig writes them.

    Args:
        rng: source of all choices.
        names: of the faults; by default none to `like` of them.
        like: largest number of faults.
    """
    spring = straight_spring(rng)
    if names is None:
        count = int(rng.integers(0, like + 1))
        names = _drawn(rng, count)
    for name, fault in ALL.items():
        if name in names:
            spring.faults[name] = float(fault(spring, rng))
    _read(spring, rng)
    return spring


def _drawn(rng: np.random.Generator, count: int) -> list[str]:
    while True:
        names = list(rng.choice(list(ALL), count, replace=False))
        if sum(fault.__name__ in names for fault in STARTS) < 2:
            return names


def _read(spring: Spring, rng: np.random.Generator) -> None:
    """Replace true values by readings: noise, origins, direction, digits."""
    noise = rng.normal(0.0, spring.noise, spring.rows)
    if "oversampled" in spring.faults:
        times = int(spring.faults["oversampled"])
        noise = noise[np.arange(spring.rows) // times * times]
    force, deformation = spring.force + noise, spring.deformation
    if rng.random() < 0.4:
        force = force + rng.uniform(-1.0, 1.0) * spring.largest
    if rng.random() < 0.4:
        origin = rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-1.0, 2.0)
        deformation = deformation + origin * spring.stroke
    if rng.random() < 0.3:  # pulled, where pressing counts as positive
        force, deformation = -force, -deformation
    spring.force = _rounded(force, spring.noise / 3.0)
    step = 10 ** rng.uniform(-4.5, -3.0) * spring.stroke
    spring.deformation = _rounded(deformation, step)


def _rounded(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(values, int(np.ceil(-np.log10(step))))


def write_csv(spring: Spring, path: Path, clock: bool) -> None:
    """Write the readings under hdcal's own headers."""
    columns = [spring.deformation, spring.force]
    header = "deformation_mm,force_N"
    if clock:
        columns, header = [spring.time, *columns], f"time_s,{header}"
    table = np.column_stack(columns)
    np.savetxt(path, table, "%.10g", ",", header=header, comments="")
