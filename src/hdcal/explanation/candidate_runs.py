"""Runs that a rig can do, as records to come after those that were taken."""

from dataclasses import dataclass, replace

import numpy as np

from hdcal.data.records import Records

# Rows of every proposed run: one executable serves them all.
ROWS = 32


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


# What to do, its cost and effort, the path, its seconds a row over the usual ones, and
# what else changes.
_RUNS = (
    ("load and unload at the same rate", "one cycle", 1.5, "loop", 1.0, ""),
    ("load and unload four times faster", "one cycle", 1.5, "loop", 0.25, ""),
    ("load and unload ten times slower", "one slow cycle", 4.0, "loop", 10.0, ""),
    ("load, then hold the top for a minute", "two minutes", 2.0, "hold", 1.0, ""),
    (
        "load and unload at {other:.0f} °C",
        *("one change of temperature", 6.0, "loop", 1.0, "other temperature"),
    ),
    (
        "re-seat the gear and load again in finer steps at small {{displacement}}s",
        *("one mounting", 2.0, "fine", 1.0, ""),
    ),
    ("small loops between half and 0.7 of the top", "one cycle", 1.5, "inner", 1.0, ""),
    (
        "load to 1.25 of the tested {{displacement}}",
        *("one run beyond the tested range", 5.0, "beyond", 1.0, ""),
    ),
    ("turn the gear by 90° and load again", "one mounting", 2.0, "up", 1.0, "angle"),
    ("load a second gear of the same kind", "one gear", 8.0, "up", 1.0, "gear"),
    (
        "go back to the first temperature, {first:.0f} °C, and load again",
        *("one change of temperature", 6.0, "loop", 1.0, "first temperature"),
    ),
)


def candidate_runs(
    records: Records, reference_temperature: float
) -> list[CandidateRun]:
    """Return the runs that could come next, made to fit what was tested.

    Args:
        records: what was taken, run after run.
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
    return [
        CandidateRun(
            words.format(other=other, first=first),
            cost,
            effort,
            _rows(records, paths[path], slower * pace, **changes[change]),
        )
        for words, cost, effort, path, slower, change in _RUNS
        if change in changes
    ]


def _paths(records: Records) -> dict[str, np.ndarray]:
    """Return deformations [mm] by name, of `ROWS` rows each."""
    low, top = _ends(records)
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


def _ends(records: Records) -> tuple[float, float]:
    """Return the least and the most loaded deformation; both signs are loads."""
    low, top = float(np.min(records.deformation)), float(np.max(records.deformation))
    return (low, top) if abs(top) >= abs(low) else (top, low)


def _pace(records: Records) -> float:
    """Return seconds between rows, ordinary ones where no time was measured."""
    if "time" not in records.known:
        return 5.0
    steps = np.diff(records.time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else 5.0


def _rows(records: Records, path, seconds: float, **columns) -> Records:
    step = np.diff(path, prepend=path[0])
    direction = np.sign(step)
    direction[0] = np.sign(path[1] - path[0])
    sense = direction.copy()
    for index in range(1, len(sense)):
        sense[index] = sense[index] or sense[index - 1]
    # A hold lasts a minute in all, whatever the pace of the rest.
    held = direction == 0.0
    time = np.cumsum(np.where(held, 60.0 / max(np.count_nonzero(held), 1), seconds))
    last = {
        name: np.asarray(getattr(records, name))[-1]
        for name in ("temperature", "angle", "specimen")
    }
    return replace(
        records,
        deformation=np.asarray(path, float),
        time=time,
        direction=direction,
        sense=sense,
        rate=np.where(held, 0.0, step / seconds),
        run=np.full(len(path), int(np.max(records.run)) + 1),
        force=np.zeros(len(path)),
        force_sd=np.full(len(path), float(np.mean(records.force_sd))),
        **{n: np.full(len(path), v) for n, v in (last | columns).items()},
    )
