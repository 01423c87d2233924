"""Least squares finds what it is given, effects of temperature included."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_cases import NOISE, rich, simulated
from rigs import make_case

from hdcal.blind.rival_methods import NONE, fit_each, own_form_closure
from hdcal.physics.registry import EFFECTS

SHOWN = {
    "thermal_zero_drift": lambda r: 0.08 * (r.temperature - 20.0),
    "coulomb_friction": lambda r: 1.5 * r.sense,
}


def clean(name: str):
    """Return a straight line with one effect, without noise."""
    records = simulated(rich()).records
    soft = 1.0 - 3e-4 * (records.temperature - 20.0)
    force = 195.0 * records.deformation * soft + SHOWN[name](records)
    return make_case(replace(records, force=force))


@pytest.mark.parametrize("name", SHOWN)
def test_an_effect_closes_its_own_gap(name):
    assert own_form_closure(clean(name), name, EFFECTS, NOISE) > 0.95
    wrong = own_form_closure(clean(name), "screw_error", EFFECTS, NOISE)
    assert wrong < 0.3


@pytest.mark.parametrize("name", SHOWN)
def test_the_true_effect_fits(name):
    found = fit_each(clean(name), EFFECTS, NOISE)
    # With an amplitude that nothing holds back, others may do as well.
    assert found[name].square < 0.01 * found[NONE].square
    assert found[name].bic < found[NONE].bic


def test_noise_alone_is_best_left_alone():
    found = fit_each(simulated(rich(), seed=6), EFFECTS)
    assert min(found, key=lambda n: found[n].bic) == NONE
    # In sample every effect fits at least as well as none.
    assert all(f.square <= found[NONE].square + 1e-9 for f in found.values())


def test_what_the_base_absorbs_leaves_no_gap():
    records = simulated(rich()).records
    soft = 1.0 - 3e-4 * (records.temperature - 20.0)
    force = 180.0 * records.deformation * soft + 3.0
    line = make_case(replace(records, force=force))
    left = fit_each(line, {}, NOISE)[NONE].square
    assert np.sqrt(left / len(records.force)) < 0.2
