"""Cases with a known truth, one shape of each program so that little is compiled."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from rigs import make_case, make_gear, make_records

from hdcal.data.case import Case
from hdcal.data.records import Records
from hdcal.diagnosis.diagnose import diagnose
from hdcal.diagnosis.result import Diagnosis
from hdcal.physics.chain import Base, Reading, predict_reading
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS

NOISE = 0.4


def rich() -> Records:
    """Return 180 rows: three temperatures, each loaded, held and unloaded twice."""
    up, held = np.linspace(0.02, 0.54, 12), np.full(6, 0.54)
    half = np.concatenate([up, held, up[::-1]])
    way = np.repeat([1.0, 0.0, -1.0], [12, 6, 12])
    pace = np.repeat([1.0, 4.0] * 3, 30) * np.where(np.tile(way, 6) == 0.0, 20.0, 1.0)
    direction = np.tile(way, 6)
    return make_records(
        np.tile(half, 6),
        known={"temperature", "time", "unloading", "cycles"}
        | {"holds", "rates", "holds or rates"},
        temperature=np.repeat([20.0, 80.0, 50.0], 60),
        time=np.cumsum(pace),
        sense=np.where(direction == 0.0, 1.0, direction),
        direction=direction,
        rate=direction * (up[1] - up[0]) / pace,
    )


def simulated(
    records: Records,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    *,
    seed: int = 0,
    correlation: float = 0.0,
    freedom: float = np.inf,
    library: Mapping[str, type[Effect]] = EFFECTS,
    **gear,
) -> Case:
    """Return a case with these effects and Gaussian, serial or heavy-tailed noise."""
    rng = np.random.default_rng(seed)
    size = len(records.force)
    noise = rng.normal(size=size)
    if np.isfinite(freedom):
        noise = rng.standard_t(freedom, size) / np.sqrt(freedom / (freedom - 2.0))
    for row in range(1, size):
        noise[row] *= np.sqrt(1.0 - correlation**2)
        noise[row] += correlation * noise[row - 1]
    made = tuple(library[name](**values) for name, values in (effects or {}).items())
    base = Base(195.0, 3e-4, 0.003, 1.0, NOISE)
    mean, _ = predict_reading(base, made, records, Reading(1.0, 20.0))
    force = np.asarray(mean) + NOISE * noise
    return make_case(replace(records, force=force), make_gear(**gear))


def judged(case: Case, **settings) -> Diagnosis:
    """Return the quick diagnosis."""
    return diagnose(case, quick=True, **settings)
