"""Effects that the dynamic model takes along depend on the moment only."""

import jax
import numpy as np
import pytest
from effect_bench import typical

from hdcal import EFFECTS
from hdcal.physics.chain import predict_reading
from hdcal.physics.dynamics import acting

ROWS = [3, 22, 40, 100, 160]


def reads(name, base, records, reading) -> np.ndarray:
    """Return the mean reading with one effect."""
    return np.asarray(predict_reading(base, (typical(name),), records, reading)[0])


def together_and_alone(name, base, records, reading):
    """Return some rows' readings among all others, and each row's by itself."""
    whole = reads(name, base, records, reading)[ROWS]
    rows = [jax.tree.map(lambda x, i=i: x[i : i + 1], records) for i in ROWS]
    return whole, np.concatenate([reads(name, base, row, reading) for row in rows])


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if e.instantaneous])
def test_what_instantaneous_remembers_nothing(name, base, loading, reading):
    whole, alone = together_and_alone(name, base, loading, reading)
    assert alone == pytest.approx(whole, rel=1e-12, abs=1e-12)
    assert EFFECTS[name].stage in ("deformation", "force")
    # The motion holds deformation, speed and temperature; no angle, run or gear.
    assert not EFFECTS[name].needs & {"angle", "time", "cycles", "runs", "specimens"}


@pytest.mark.parametrize("name", ["relaxation", "hysteresis", "stiffness_fatigue"])
def test_a_memory_is_noticed_by_the_same_test(name, base, loading, reading):
    whole, alone = together_and_alone(name, base, loading, reading)
    assert np.max(np.abs(alone - whole)) > 1e-3


def test_what_belongs_to_gauges_and_sensors_is_left_out():
    kept, left = acting(tuple(EFFECTS.values()))
    assert {*kept, *left} == set(EFFECTS.values())
    assert {effect.name for effect in left} >= {
        "plastic_yield",
        "charge_leakage",
        "thermal_expansion",
        "displacement_nonlinearity",
        "screw_error",
        "ovality",
    }
