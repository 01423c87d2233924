"""Log evidences are those of a reference: cells, grids, kernels and noises."""

import numpy as np
import pytest
from diagnosis_cases import rich, simulated
from reference import assert_reference
from rigs import make_records

from hdcal.data.case import Case
from hdcal.evidence.search import search
from hdcal.physics.effect import Effect
from hdcal.physics.registry import EFFECTS


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
    assert_reference(__file__, name, log_evidences(*CASES[name]()), abs=5e-3)
