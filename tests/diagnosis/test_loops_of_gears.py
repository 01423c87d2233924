"""Several gears, one of them softer, and a loop in each: two things at once.

What is said of the loop must not be said of the gears' scatter, which is surer.
"""

import numpy as np
import pytest
from diagnosis_cases import NOISE, judged
from rigs import make_case, make_records

from hdcal.physics.registry import EFFECTS

LOOPS = ("plastic_yield", "hysteresis")
GEARS, STEPS = 6, 9


@pytest.fixture(scope="module")
def verdict():
    rng = np.random.default_rng(1)
    up = np.linspace(0.0, 0.6, STEPS)
    path = np.concatenate([up, up[-2::-1]])
    stuck, slip = 0.0, []
    for step in np.diff(path, prepend=0.0):
        stuck = np.clip(stuck + 22.0 * step, -1.5, 1.5)
        slip.append(stuck)
    stiffness = 100.0 * (1.0 + 0.015 * rng.normal(size=GEARS))
    stiffness[3] *= 0.85
    force = np.outer(stiffness, path) + slip
    force += NOISE * rng.normal(size=force.shape)
    records = make_records(
        np.tile(path, GEARS),
        known={"unloading", "specimens"},
        specimen=np.repeat(np.arange(GEARS), len(path)),
        run=np.repeat(np.arange(GEARS), len(path)),
        sense=np.tile(np.repeat([1.0, -1.0], [STEPS, STEPS - 1]), GEARS),
        force=force.ravel(),
    )
    names = (*LOOPS, "specimen_variation", "coulomb_friction")
    return judged(make_case(records), library={n: EFFECTS[n] for n in names})


def test_of_a_group_its_own_effect_leads(verdict):
    which = verdict.which
    assert (which.verdict, which.group) == ("group", "loop")
    assert which.effect in LOOPS
    assert which.inclusion["specimen_variation"] > which.inclusion[which.effect]
    assert which.second_effect == "specimen_variation"


def test_what_closes_the_gap_is_both(verdict):
    assert verdict.shrink.closed.median > 0.9


def test_a_run_is_proposed_that_tells_the_loops_apart(verdict):
    assert {*verdict.next_test[0].separates} == {*LOOPS}
