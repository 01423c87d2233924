"""Log evidences are those of a reference, which `python test_reference.py` renews.

The reference guards numbers that other tests hold within bounds only: cells, grids,
kernels and noises of every hypothesis. A change of method renews it, on purpose.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from rigs import make_records

from hdcal.data.case import Case
from hdcal.evidence.search import search
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS

REFERENCE = Path(__file__).with_name("reference.json")


def runs_of_gears() -> Case:
    """Return six loaded runs of three gears, at uneven times, with outliers."""
    rows, rng = 14, np.random.default_rng(4)
    run = np.repeat(np.arange(6), rows)
    records = make_records(
        np.tile(np.linspace(0.02, 0.54, rows), 6),
        run=run,
        specimen=run // 2,
        time=np.cumsum(rng.choice([1.0, 1.0, 9.0], 6 * rows)),
        known={"run", "runs", "specimen", "specimens", "time"},
    )
    effects = {"progressive_stiffening": {"slope": 0.3}}
    return simulated(records, effects, seed=2, freedom=3.0)


LOOP = {"hysteresis": {"force": 4.0, "reach": 0.1}}
# Each of another kind: scatter, one amplitude, several, a kink, the noise.
FEW = (
    "run_offset",
    "specimen_variation",
    "progressive_stiffening",
    "screw_error",
    "seating_slack",
    "heteroscedastic_noise",
    "outliers",
)
CASES = {
    "loop": lambda: (simulated(rich(), LOOP, correlation=0.5), EFFECTS),
    "runs": lambda: (runs_of_gears(), {name: EFFECTS[name] for name in FEW}),
}


def log_evidences(case: Case, library: dict[str, type[Effect]]) -> dict[str, float]:
    """Return log evidences over that of no effect, summed over models of the noise."""
    table = search(case, library).table
    whole = {k: float(np.logaddexp.reduce(v)) for k, v in table.log_evidence.items()}
    return {"+".join(key): value - whole[()] for key, value in whole.items()}


@pytest.mark.parametrize("name", CASES)
def test_log_evidences_are_those_of_the_reference(name: str):
    found, expected = log_evidences(*CASES[name]()), json.loads(REFERENCE.read_text())
    assert found == pytest.approx(expected[name], abs=5e-3)


if __name__ == "__main__":
    values = {name: log_evidences(*make()) for name, make in CASES.items()}
    rounded = {
        name: {key: round(value, 4) for key, value in sorted(found.items())}
        for name, found in values.items()
    }
    REFERENCE.write_text(json.dumps(rounded, indent=1) + "\n", "utf-8")
