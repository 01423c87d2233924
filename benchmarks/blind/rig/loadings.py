"""Loading programs of the rig, and the files that it writes."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.blind.rig.history import FULL, History, last_true

POINTS = 13  # readings of half a loop, unless stated otherwise
LOWEST = 0.02  # deformation where the loadings begin [mm]
# array of the history: column of the file, how a value is written
_COLUMNS = {
    "temperature": ("temperature_C", lambda v: f"{v:.2f}"),
    "time": ("time_s", lambda v: f"{v:.2f}"),
    "angle": ("angle_deg", lambda v: f"{np.rad2deg(v):.2f}"),
    "run": ("run", lambda v: str(v + 1)),
    "specimen": ("specimen", lambda v: str(v + 1)),
}
# Force at the largest deformation of the simulated rigs [N], about.
_FULL_FORCE = 0.5 * (150.0 + 260.0) * FULL
# Full scales of real rigs [N, mm].
_FORCES, _DEFORMATIONS = (5.0, 50e3), (0.05, 20.0)


@dataclass(frozen=True)
class Writing:
    """Scales and number formats of a measurement file.

    Attributes:
        force: newtons in the file per newton of the simulation.
        deformation: likewise of millimetres.
        force_form: format of a force.
        deformation_form: format of a deformation.
    """

    force: float
    deformation: float
    force_form: str
    deformation_form: str


def draw_writing(rng: np.random.Generator) -> Writing:
    """Draw full scales, and whether the logger keeps digits or decimals."""
    force, deformation = (
        math.exp(rng.uniform(*np.log(ends))) for ends in (_FORCES, _DEFORMATIONS)
    )
    forms = ".6g", ".6g"
    if rng.uniform() < 0.5:
        forms = tuple(f".{_decimals(full)}f" for full in (force, deformation))
    return Writing(force / _FULL_FORCE, deformation / FULL, *forms)


def _decimals(full_scale: float) -> int:
    """Return the number of decimals that is far below any noise: 1e-4 of full scale."""
    return max(0, 4 - math.floor(math.log10(full_scale)))


@dataclass(frozen=True)
class Loading:
    """A history and the columns that the rig writes besides deformation and force."""

    name: str
    history: History
    columns: tuple[str, ...] = ()

    @property
    def features(self) -> frozenset[str]:
        """What a mechanism may need: the columns, and how they vary."""
        history, found = self.history, set(self.columns)
        if np.any(history.direction < 0.0):
            found.add("unloading")
        if np.any(history.direction == 0.0):
            found.add("holds")
        step, seconds = np.diff(history.deformation), np.diff(history.time)
        moves = (step != 0.0) & (seconds > 0.0)
        speed = np.abs(step[moves]) / seconds[moves]
        if "time" in found and moves.any() and speed.max() > 1.5 * speed.min():
            found.add("rates")
        if found & {"holds", "rates"}:
            found.add("holds or rates")
        for gear in np.unique(history.specimen):
            if np.ptp(history.cycle[history.specimen == gear]) > 0:
                found.add("cycles")
        for label in ("run", "specimen"):
            if label in found and len(np.unique(getattr(history, label))) >= 3:
                found.add(f"{label}s")
        return frozenset(found)

    def csv(self, force: np.ndarray, writing: Writing) -> str:
        """Return the measurement file of these readings [N], shape (n,)."""
        deformation = self.history.deformation * writing.deformation
        table = {
            "deformation_mm": [
                format(v, writing.deformation_form) for v in deformation
            ],
            "force_N": [format(v, writing.force_form) for v in force * writing.force],
        }
        for name, (column, written) in _COLUMNS.items():
            if name in self.columns:
                table[column] = [written(v) for v in getattr(self.history, name)]
        lines = [",".join(table), *map(",".join, zip(*table.values(), strict=True))]
        return "\n".join(lines) + "\n"


def ramp() -> Loading:
    """One loading in 60 readings of deformation and force only."""
    return Loading("ramp", _history(np.linspace(LOWEST, FULL, 60), 5.0))


def rich(points: int = POINTS) -> Loading:
    """Three mountings, three temperatures out of order, two rates, six angles."""
    return _loops(
        "rich" if points == POINTS else f"rich-{6 * (2 * points + 4)}",
        points=points,
        temperature=(20.0, 50.0, 35.0, 20.0, 50.0, 35.0),
        seconds=(1.0, 5.0, 1.0, 5.0, 5.0, 1.0),
        angle=(0.0, 120.0, 240.0, 60.0, 300.0, 180.0),
        run=(0, 0, 1, 1, 2, 2),
        columns=("temperature", "time", "angle", "run"),
    )


def lean() -> Loading:
    """One mounting at one rate: the rig warms up while the gear is turned."""
    return _loops(
        "lean",
        temperature=(20.0, 26.0, 32.0, 38.0, 44.0, 50.0),
        angle=(0.0, 60.0, 120.0, 180.0, 240.0, 300.0),
        columns=("temperature", "time", "angle"),
    )


def rates() -> Loading:
    """Six loads and unloads at four rates, all else constant."""
    return _loops("rates", seconds=(0.5, 10.0, 2.0, 0.5, 40.0, 10.0), columns=("time",))


def holds() -> Loading:
    """Long holds at the top and the bottom."""
    return _loops("holds", hold=90.0, columns=("time",))


def angles() -> Loading:
    """Twelve loads and unloads, each at another angle."""
    turned = 30.0 * np.array([0, 5, 10, 3, 8, 1, 6, 11, 4, 9, 2, 7])
    return _loops(
        "angles", count=12, angle=turned, points=7, hold=0.0, columns=("time", "angle")
    )


def fleet() -> Loading:
    """Six gears, each mounted, loaded and unloaded once."""
    each = np.arange(6)
    return _loops("fleet", run=each, specimen=each, columns=("time", "run", "specimen"))


LOADINGS: dict[str, Callable[[], Loading]] = {
    loading.__name__: loading
    for loading in (ramp, rich, lean, rates, holds, angles, fleet)
}


def _loops(
    name: str,
    *,
    columns: tuple[str, ...],
    count: int = 6,
    temperature: ArrayLike = 20.0,
    seconds: ArrayLike = 5.0,
    angle: ArrayLike = 0.0,
    run: ArrayLike = 0,
    specimen: ArrayLike = 0,
    points: int = POINTS,
    hold: float = 20.0,
) -> Loading:
    """Return loads and unloads with two rows of a hold at the top and the bottom.

    Args:
        name: of the loading.
        columns: of the file.
        count: number of loops.
        temperature: of each loop, or of all [°C].
        seconds: between the rows of each loop, or of all.
        angle: of each loop, or of all [deg].
        run: of each loop, or of all.
        specimen: of each loop, or of all.
        points: readings of each half loop.
        hold: seconds of a row of a hold; 0 for no hold.
    """
    still = 2 if hold else 0
    up = np.linspace(LOWEST, FULL, points)
    top, bottom = np.full(still, FULL), np.full(still, LOWEST)
    # Without a hold the row at a turn is read once.
    down = up[::-1] if hold else up[-2:0:-1]
    loop = np.concatenate([up, top, down, bottom])

    def by_row(values: ArrayLike) -> np.ndarray:
        return np.repeat(np.broadcast_to(values, count), len(loop))

    path = np.tile(loop, count)
    moves = np.diff(path, prepend=0.0) != 0.0
    history = _history(
        path,
        np.where(moves, by_row(seconds), hold),
        temperature=by_row(temperature),
        angle=np.deg2rad(by_row(angle)),
        cycle=by_row(np.arange(count)),
        run=by_row(run),
        specimen=by_row(specimen),
    )
    return Loading(name, history, columns)


def _history(path: np.ndarray, step: ArrayLike, **known: np.ndarray) -> History:
    """Return a history along a path with seconds per row; the rest stays constant."""
    size = len(path)
    run = known.get("run", np.zeros(size, int))
    begins = np.diff(run, prepend=-1) != 0
    direction = np.where(begins, 1.0, np.sign(np.diff(path, prepend=0.0)))
    elapsed = np.cumsum(np.broadcast_to(step, size))
    zeros = np.zeros(size)
    return History(
        deformation=path,
        temperature=known.get("temperature", zeros + 20.0),
        time=elapsed - elapsed[last_true(begins)],
        angle=known.get("angle", zeros),
        direction=direction,
        sense=direction[last_true(direction != 0.0)],
        cycle=known.get("cycle", zeros.astype(int)),
        run=run,
        specimen=known.get("specimen", zeros.astype(int)),
        force=zeros,
    )
