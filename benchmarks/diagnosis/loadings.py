"""Loadings: what a rig did, before any force was read."""

import numpy as np

from hdcal.data.records import Records

LOWEST, HIGHEST = 0.02, 0.54
_PAIRS = 6
_ALWAYS = {"temperature", "time", "angle", "unloading", "holds", "cycles"}


def rich() -> Records:
    """Return 180 rows in three runs: what varies does so out of order."""
    return _loops(
        temperature=(20.0, 50.0, 35.0, 20.0, 50.0, 35.0),
        fast=(1, 0, 1, 0, 0, 1),
        run=(0, 0, 1, 1, 2, 2),
        angle=(0.0, 120.0, 240.0, 60.0, 300.0, 180.0),
        known=_ALWAYS | {"rates", "run", "runs"},
    )


def lean() -> Records:
    """Return 180 rows in one run at one rate: it warms up while the gear is turned."""
    return _loops(
        temperature=(20.0, 26.0, 32.0, 38.0, 44.0, 50.0),
        fast=(0,) * _PAIRS,
        run=(0,) * _PAIRS,
        angle=(0.0, 60.0, 120.0, 180.0, 240.0, 300.0),
        known=_ALWAYS,
    )


def line(rows: int) -> Records:
    """Return one ramp of which nothing but deformation and force is known."""
    return _records(np.linspace(LOWEST, HIGHEST, rows), known=frozenset())


def _loops(temperature, fast, run, angle, known) -> Records:
    """Return six loads and unloads, each held for two rows at the top and the bottom.

    A row takes one second when fast, else five; a row of a hold takes twenty.
    """
    up, two = np.linspace(LOWEST, HIGHEST, 13), np.ones(2)
    loop = np.concatenate([up, HIGHEST * two, up[::-1], LOWEST * two])
    move = np.repeat([1.0, 0.0, -1.0, 0.0], [13, 2, 13, 2])
    rows = len(loop)
    run, fast = np.repeat(run, rows), np.repeat(fast, rows)
    direction = np.tile(move, _PAIRS)
    pace = np.where(fast == 1, 1.0, 5.0)
    seconds = np.where(direction == 0.0, 20.0, pace)
    since = [np.cumsum(seconds[run == each]) for each in np.unique(run)]
    return _records(
        np.tile(loop, _PAIRS),
        known=frozenset(known),
        temperature=np.repeat(temperature, rows),
        time=np.concatenate(since),
        angle=np.deg2rad(np.repeat(angle, rows)),
        direction=direction,
        sense=np.tile(np.repeat([1.0, -1.0], rows // 2), _PAIRS),
        rate=direction * (up[1] - up[0]) / pace,
        run=run,
    )


def _records(deformation, *, known, **columns) -> Records:
    count = len(deformation)
    neutral = {name: np.zeros(count) for name in ("time", "angle", "rate")}
    neutral |= {name: np.zeros(count) for name in ("force", "force_sd")}
    neutral |= {name: np.ones(count) for name in ("direction", "sense")}
    neutral |= {name: np.zeros(count, dtype=int) for name in ("run", "specimen")}
    neutral["temperature"] = np.full(count, 20.0)
    return Records(deformation=deformation, known=known, **(neutral | columns))


LOADINGS = {"rich": rich, "lean": lean}
