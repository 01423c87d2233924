"""Which hypotheses are calibrated, and which model stands for the others."""

from types import SimpleNamespace

import numpy as np
import pytest
from posteriors import beside, single
from rigs import cycles, make_case, make_records

from hdcal.diagnosis.diagnose import _stiffness
from hdcal.diagnosis.refit import Refits, refit, rows_to_calibrate, weighed
from hdcal.inference.model_average import LeftOut
from hdcal.physics.registry import EFFECTS


def fits(chances: dict, failing=(), widths=None):
    """Return the refits, and the names that were calibrated."""
    names = []

    def calibrated(name: str):
        names.append(name)
        width = (widths or {}).get(name, 1.0)
        draws = {"stiffness": 200.0 + width * np.array([-1.0, 1.0])}
        return SimpleNamespace(usable=name not in failing, draws=draws, reasons=("no",))

    return weighed(chances, calibrated), names


PAIRS = {f"a+{name}": 0.04 for name in "defg"}
# Chances, calibrations that fail, widths; what is calibrated, the shares of the models,
# and which of them stands for the others.
CASES = {
    "the likeliest effect with a discrepancy": (
        ({"a": 0.7, "none": 0.06, "unknown": 0.06, "c": 0.02, **PAIRS},),
        {"a": 0.7, "none": 0.06, "unknown": 0.06, "a+unknown": 0.18},
        "a+unknown",
    ),
    "none is likeliest": (
        ({"none": 0.49, "a": 0.35, **PAIRS},),
        {"none": 0.49, "a": 0.35, "unknown": 0.16},
        "unknown",
    ),
    "their model fails": (
        ({"a": 0.7, "none": 0.12, "c": 0.02, **PAIRS}, ("a+unknown",)),
        {"a": 0.7, "none": 0.12, "unknown": 0.18},
        "unknown",
    ),
    "calibrated anyway": (
        ({"a": 0.75, "a+unknown": 0.1, "a+c": 0.04, "a+d": 0.11},),
        {"a": 0.75, "a+d": 0.11, "a+unknown": 0.14},
        "a+unknown",
    ),
    "2 % and less": (
        ({"a": 0.9, "b": 0.085, "unknown": 0.01, "none": 0.005}, (), {"b": 3.0}),
        {"a": 0.9, "b": 0.1},
        "b",
    ),
    "the likeliest fails": (
        ({"a": 0.7, "b": 0.3}, ("a",)),
        {"b": 0.3, "a+unknown": 0.7},
        "a+unknown",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_probabilities_of_the_models(case: str):
    given, shares, carrier = CASES[case]
    found, names = fits(*given)
    probabilities = {name: share for name, (share, _) in found.posteriors.items()}
    assert probabilities == pytest.approx(shares)
    assert found.left_out.counted_as == carrier
    before = sum(given[0].get(name, 0.0) for name in shares)
    assert found.left_out.probability == pytest.approx(1.0 - before, abs=1e-9)
    failed = given[1] if len(given) > 1 else ()
    assert sorted(names) == sorted({*shares, *failed})


def test_effects_without_readings_for_a_calibration_are_carried_by_another(monkeypatch):
    """A loop that was read at one speed may be viscous, which no calibration takes."""
    case, names = make_case(cycles(48)), []
    assert "rates" not in case.records.known

    def calibrated(_, *, effects, with_gap, **__):
        names.append((effects, with_gap))
        draws = {"stiffness": np.array([199.0, 201.0])}
        return SimpleNamespace(usable=True, draws=draws, reasons=())

    monkeypatch.setattr("hdcal.calibration.calibrate.calibrate", calibrated)
    chances = {("coulomb_friction",): 0.6, ("viscous_damping",): 0.3, (): 0.1}
    found = refit(case, chances, EFFECTS, 0, None)
    friction = ("coulomb_friction",)
    assert names == [(friction, False), ((), False), (friction, True)]
    assert found.left_out is not None
    assert found.left_out.probability == pytest.approx(0.3)
    assert found.left_out.counted_as == "coulomb_friction+unknown"


def test_a_discrepancy_stands_for_curves_of_the_deformation(monkeypatch):
    case, names = make_case(cycles(48)), []

    def calibrated(_, *, effects, with_gap, **__):
        names.append((effects, with_gap))
        draws = {"stiffness": np.array([199.0, 201.0])}
        return SimpleNamespace(usable=True, draws=draws, reasons=())

    monkeypatch.setattr("hdcal.calibration.calibrate.calibrate", calibrated)
    friction, onset = "coulomb_friction", "contact_onset"
    both = (onset, friction, "outside")
    chances = {(onset,): 0.6, (onset, "outside"): 0.25, both: 0.15}
    found = refit(case, chances, EFFECTS, 0, None)
    expected = [((onset,), False), ((), True), ((friction,), True)]
    assert sorted(names) == sorted(expected)
    shares = {name: share for name, (share, _) in found.posteriors.items()}
    assert shares == pytest.approx(
        {onset: 0.6, "unknown": 0.25, f"{friction}+unknown": 0.15}
    )


def test_nothing_is_left_where_all_calibrations_fail():
    found, _ = fits({"a": 0.3, "b": 0.7}, ("a", "b", "b+unknown", "unknown"))
    assert not found.posteriors and found.left_out is None
    assert len(found.failures) == 4


def test_long_logs_are_calibrated_on_single_rows_that_hold_the_turns():
    long = make_case(cycles(12_000))
    few = rows_to_calibrate(long)
    assert 900 <= len(few.records.force) <= 1_100
    assert set(np.asarray(few.records.force)) <= set(np.asarray(long.records.force))
    assert np.max(few.records.deformation) == np.max(long.records.deformation)
    assert len(few.notes) == len(long.notes) + 1
    # Turns of more half cycles than rows that are kept would not be few.
    ways = np.tile([1.0, -1.0], 6_000)
    restless = make_case(make_records(0.2 + 0.1 * ways, sense=ways))
    assert len(rows_to_calibrate(restless).records.force) <= 1_000
    short = make_case(cycles(102))
    assert rows_to_calibrate(short) is short


@pytest.mark.parametrize(
    ("names", "averaged"),
    [
        (("coulomb_friction", "thermal_zero_drift"), True),
        # Before contact, and after play is taken up.
        (("contact_onset", "seating_slack"), False),
        (("contact_onset", "coulomb_friction"), False),
    ],
)
def test_only_stiffnesses_of_one_meaning_are_averaged(names, averaged: bool):
    plain = single(size=20)
    models = {name: (0.5, beside(plain, name)) for name in names}
    found = _stiffness(Refits(models, None, ()))
    assert (found is not None) == averaged
    # Of most hypotheses none is calibrated.
    assert _stiffness(Refits(models, LeftOut(0.6, names[0]), ())) is None
