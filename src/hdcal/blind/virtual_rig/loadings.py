"""Loading programs: what each rig of the blind check does and writes down."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hdcal.blind.virtual_rig.history import History
from hdcal.data.case import Case

LOWEST, HIGHEST = 0.02, 0.54


@dataclass(frozen=True)
class Program:
    """A history and the columns that the rig writes beside deformation and force."""

    name: str
    history: History
    columns: tuple[str, ...] = ()

    @property
    def features(self) -> frozenset[str]:
        """What can be told from the columns: they themselves, and how they vary."""
        told, found = self.history, set(self.columns)
        if np.any(told.direction < 0.0):
            found.add("unloading")
        if np.any(told.direction == 0.0):
            found.add("holds")
        step, seconds = np.diff(told.deformation), np.diff(told.time)
        moves = (step != 0.0) & (seconds > 0.0)
        speed = np.abs(step[moves]) / seconds[moves]
        if "time" in found and moves.any() and speed.max() > 1.5 * speed.min():
            found.add("rates")
        for gear in np.unique(told.specimen):
            if np.ptp(told.cycle[told.specimen == gear]) > 0:
                found.add("cycles")
        for label in ("run", "specimen"):
            if label in found and len(np.unique(getattr(told, label))) >= 3:
                found.add(f"{label}s")
        return frozenset(found)

    def csv(self, force: np.ndarray) -> str:
        """Return the measurement file of these readings [N], shape (n,)."""
        told = self.history
        table = {"deformation_mm": [f"{v:.5f}" for v in told.deformation]}
        table["force_N"] = [f"{v:.4f}" for v in force]
        if "temperature" in self.columns:
            table["temperature_C"] = [f"{v:.2f}" for v in told.temperature]
        if "time" in self.columns:
            table["time_s"] = [f"{v:.2f}" for v in told.time]
        if "angle" in self.columns:
            table["angle_deg"] = [f"{v:.2f}" for v in np.rad2deg(told.angle)]
        for label in ("run", "specimen"):
            if label in self.columns:
                table[label] = [str(v + 1) for v in getattr(told, label)]
        lines = [",".join(table), *map(",".join, zip(*table.values(), strict=True))]
        return "\n".join(lines) + "\n"


def ramp() -> Program:
    """One loading in 60 readings; nothing but deformation and force is written."""
    return Program("ramp", _history(np.linspace(LOWEST, HIGHEST, 60), 5.0))


def rich() -> Program:
    """Three mountings, three temperatures out of order, two rates, six angles."""
    return _loops(
        "rich",
        temperature=(20.0, 50.0, 35.0, 20.0, 50.0, 35.0),
        seconds=(1.0, 5.0, 1.0, 5.0, 5.0, 1.0),
        angle=(0.0, 120.0, 240.0, 60.0, 300.0, 180.0),
        run=(0, 0, 1, 1, 2, 2),
        columns=("temperature", "time", "angle", "run"),
    )


def lean() -> Program:
    """One mounting at one rate: the rig warms up while the gear is turned."""
    return _loops(
        "lean",
        temperature=(20.0, 26.0, 32.0, 38.0, 44.0, 50.0),
        angle=(0.0, 60.0, 120.0, 180.0, 240.0, 300.0),
        columns=("temperature", "time", "angle"),
    )


def rates() -> Program:
    """Six loads and unloads at four rates, all else constant."""
    return _loops("rates", seconds=(0.5, 10.0, 2.0, 0.5, 40.0, 10.0), columns=("time",))


def holds() -> Program:
    """Long holds at the top and the bottom."""
    return _loops("holds", hold=90.0, columns=("time",))


def angles() -> Program:
    """Twelve loads and unloads, each at an angle of its own."""
    turned = tuple(30.0 * np.array([0, 5, 10, 3, 8, 1, 6, 11, 4, 9, 2, 7]))
    return _loops("angles", angle=turned, points=7, hold=0.0, columns=("time", "angle"))


def fleet() -> Program:
    """Six gears, each mounted, loaded and unloaded once."""
    each = tuple(range(6))
    return _loops("fleet", run=each, specimen=each, columns=("time", "run", "specimen"))


PROGRAMS: dict[str, Callable[[], Program]] = {
    "ramp": ramp,
    "rich": rich,
    "lean": lean,
    "rates": rates,
    "holds": holds,
    "angles": angles,
    "fleet": fleet,
}


def program_of(case: Case) -> Program:
    """Return the program that a measured case went through."""
    told = case.records
    unloaded = (np.diff(told.sense, prepend=told.sense[0]) > 0).astype(int)
    columns = {"temperature", "time", "angle", "run", "specimen"} & told.known
    history = History(
        *(
            np.asarray(getattr(told, name), dtype=float)
            for name in ("deformation", "temperature", "time", "angle")
        ),
        direction=np.asarray(told.direction),
        sense=np.asarray(told.sense),
        cycle=np.cumsum(unloaded),
        run=np.asarray(told.run),
        specimen=np.asarray(told.specimen),
        force=np.zeros(len(told.force)),
    )
    return Program(case.name, history, tuple(sorted(columns)))


def _loops(
    name: str,
    *,
    temperature=(20.0,) * 6,
    seconds=(5.0,) * 6,
    angle=(0.0,) * 6,
    run=(0,) * 6,
    specimen=(0,) * 6,
    points: int = 13,
    hold: float = 20.0,
    columns: tuple[str, ...],
) -> Program:
    """Return loads and unloads with two rows of a hold at the top and the bottom.

    Args:
        name: of the program.
        temperature: of each loop [°C].
        seconds: between rows of each loop.
        angle: of each loop [deg].
        run: of each loop.
        specimen: of each loop.
        points: of each half loop.
        hold: seconds of a row of a hold; without it there is none.
        columns: that are written down.
    """
    still = 2 if hold else 0
    up = np.linspace(LOWEST, HIGHEST, points)
    top, bottom = np.full(still, HIGHEST), np.full(still, LOWEST)
    # Without a hold no row is taken twice at a turn.
    down = up[::-1] if hold else up[-2:0:-1]
    loop = np.concatenate([up, top, down, bottom])
    count, rows = len(angle), len(loop)

    def each(values):
        values = tuple(values)
        return np.repeat(
            (values * count)[:count] if len(values) < count else values, rows
        )

    path = np.tile(loop, count)
    move = np.diff(path, prepend=0.0)
    step = np.where(move == 0.0, hold, each(seconds))
    run = each(run)
    history = _history(
        path,
        step,
        temperature=each(temperature).astype(float),
        angle=np.deg2rad(each(angle)),
        cycle=np.repeat(np.arange(count), rows),
        run=run,
        specimen=each(specimen),
    )
    return Program(name, history, columns)


def _history(path: np.ndarray, step, **known) -> History:
    """Return a history; what is not known stays constant."""
    size = len(path)
    run = known.get("run", np.zeros(size, int))
    begins = np.diff(run, prepend=-1) != 0
    direction = np.where(begins, 1.0, np.sign(np.diff(path, prepend=0.0)))
    sense = direction.copy()
    for row in range(1, size):
        if sense[row] == 0.0:
            sense[row] = sense[row - 1]
    elapsed = np.cumsum(np.broadcast_to(step, size))
    first = np.maximum.accumulate(np.where(begins, np.arange(size), 0))
    zeros = np.zeros(size)
    return History(
        deformation=path,
        temperature=known.get("temperature", zeros + 20.0),
        time=elapsed - elapsed[first],
        angle=known.get("angle", zeros),
        direction=direction,
        sense=sense,
        cycle=known.get("cycle", zeros.astype(int)),
        run=run,
        specimen=known.get("specimen", zeros.astype(int)),
        force=zeros,
    )
