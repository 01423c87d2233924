"""Runs that a rig can do next, as records to come after those that were measured."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from hdcal.data.records import Records

# Rows of every proposed run: one executable serves them all.
ROWS = 32
# Seconds between rows where no time was measured, and those of a hold in all.
_PACE, _HOLD = 5.0, 60.0
# What two rows of the same kind may differ by: place and place of the last turn (as
# shares of the largest deformation), direction, temperature [°C], log rate, angle
# [rad], specimen.
_ALIKE = np.array([0.1, 0.15, 0.5, 5.0, np.log(3.0), 0.3, 0.5])


@dataclass(frozen=True)
class CandidateRun:
    """One run that a rig can do.

    Attributes:
        words: what to do.
        cost: in words.
        effort: relative to one ramp [-].
        records: the rows it would give, force zero.
    """

    words: str
    cost: str
    effort: float
    records: Records


class _Plan(NamedTuple):
    """What to do, its cost and effort, the path, seconds a row over the usual ones.

    And the condition that changes; empty where none does.
    """

    words: str
    cost: str
    effort: float
    path: str
    pace: float = 1.0
    change: str = ""


_PLANS = (
    _Plan("load and unload at the same rate", "one cycle", 1.5, "loop"),
    _Plan("load and unload four times faster", "one cycle", 1.5, "loop", 0.25),
    _Plan("load and unload ten times slower", "one slow cycle", 4.0, "loop", 10.0),
    _Plan("load, then hold the top for a minute", "two minutes", 2.0, "hold"),
    _Plan(
        "load and unload at {other:.0f} °C",
        *("one change of temperature", 6.0, "loop", 1.0, "other temperature"),
    ),
    _Plan(
        "re-seat the gear and load again in finer steps at small {{displacement}}s",
        *("one mounting", 2.0, "fine"),
    ),
    _Plan("small loops between half and 0.7 of the top", "one cycle", 1.5, "inner"),
    _Plan(
        "load to 1.25 of the tested {{displacement}}",
        *("one run beyond the tested range", 5.0, "beyond"),
    ),
    _Plan(
        "turn the gear by 90° and load again", "one mounting", 2.0, "up", 1.0, "angle"
    ),
    _Plan("load a second gear of the same kind", "one gear", 8.0, "up", 1.0, "gear"),
    _Plan(
        "go back to the first temperature, {first:.0f} °C, and load again",
        *("one change of temperature", 6.0, "loop", 1.0, "first temperature"),
    ),
)


def candidate_runs(
    records: Records, reference_temperature: float
) -> list[CandidateRun]:
    """Return the runs that could come next and whose kind was not measured yet.

    Args:
        records: what was measured, run after run.
        reference_temperature: T_ref of the gear [°C].
    """
    first, last = (float(records.temperature[row]) for row in (0, -1))
    near = abs(last - reference_temperature) < 15.0
    other = last + 30.0 if near else reference_temperature
    changes: dict[str, dict[str, float]] = {
        "": {},
        "other temperature": {"temperature": other},
        "angle": {"angle": float(records.angle[-1]) + np.pi / 2.0},
        "gear": {"specimen": int(np.max(records.specimen)) + 1},
    }
    if abs(first - last) > 5.0:
        changes["first temperature"] = {"temperature": first}
    pace, paths = _pace(records), _paths(records)
    found = [
        CandidateRun(
            plan.words.format(other=other, first=first),
            plan.cost,
            plan.effort,
            _rows(records, paths[plan.path], plan.pace * pace, **changes[plan.change]),
        )
        for plan in _PLANS
        if plan.change in changes
    ]
    # Going back to the first conditions shows what changed in between.
    return [r for r in found if "go back" in r.words or not _done(records, r.records)]


def _done(old: Records, new: Records) -> bool:
    """Whether every row of a run has a row of the same kind among those measured."""
    top = float(np.max(np.abs(old.deformation)))
    kinds = (_kinds(each, old.known, top) / _ALIKE for each in (old, new))
    measured, rows = kinds
    far = np.abs(rows[:, None] - measured).max(axis=2).min(axis=1)
    return bool(np.all(far <= 1.0))


def _kinds(records: Records, known: frozenset[str], top: float) -> np.ndarray:
    """Return features of rows that effects depend on, as in `_ALIKE`, shape (n, 7)."""
    x, run = np.asarray(records.deformation) / top, np.asarray(records.run)
    direction = np.asarray(records.direction, float)
    turn = np.diff(np.asarray(records.sense), prepend=0.0) != 0
    turn |= np.diff(run, prepend=run[0] - 1) != 0
    since = np.maximum.accumulate(np.where(turn, np.arange(len(x)), 0))
    moving = (direction != 0.0) & ("time" in known)
    rate = np.log(np.where(moving, np.maximum(np.abs(records.rate), 1e-12), 1.0))
    columns = [x, x[since], direction, records.temperature, rate]
    columns += [np.mod(records.angle, 2.0 * np.pi), records.specimen]
    return np.stack([np.asarray(each, float) for each in columns], axis=1)


def _paths(records: Records) -> dict[str, np.ndarray]:
    """Return deformations [mm] by name, of `ROWS` rows each."""
    low, top = float(np.min(records.deformation)), float(np.max(records.deformation))
    # Both signs are loads.
    low, top = (low, top) if abs(top) >= abs(low) else (top, low)
    up = np.linspace(low, top, ROWS)
    small = np.linspace(0.5, 0.7, ROWS // 4) * top
    return {
        "up": up,
        "loop": np.concatenate([up[::2], up[::-2]]),
        "fine": low + (top - low) * np.linspace(0.0, 1.0, ROWS) ** 2,
        "inner": np.concatenate([small, small[::-1], small, small[::-1]]),
        "hold": np.concatenate([up[::2], np.full(ROWS // 2, top)]),
        "beyond": 1.25 * up,
    }


def _pace(records: Records) -> float:
    """Return the usual seconds between rows of the last run."""
    steps = np.diff(np.asarray(records.time)[records.run == records.run[-1]])
    steps = steps[steps > 0.0]
    measured = "time" in records.known and steps.size
    return float(np.median(steps)) if measured else _PACE


def _rows(records: Records, path, seconds: float, **columns) -> Records:
    step = np.diff(path, prepend=2.0 * path[0] - path[1])
    direction = np.sign(step)
    moving = np.maximum.accumulate(np.where(direction, np.arange(len(path)), 0))
    held = direction == 0.0
    hold = _HOLD / max(np.count_nonzero(held), 1)
    last = {
        name: np.asarray(getattr(records, name))[-1]
        for name in ("temperature", "angle", "specimen")
    }
    return replace(
        records,
        deformation=np.asarray(path, float),
        time=np.cumsum(np.where(held, hold, seconds)),
        direction=direction,
        sense=direction[moving],
        rate=np.where(held, 0.0, step / seconds),
        run=np.full(len(path), int(np.max(records.run)) + 1),
        force=np.zeros(len(path)),
        force_sd=np.full(len(path), float(np.mean(records.force_sd))),
        **{n: np.full(len(path), v) for n, v in (last | columns).items()},
    )
