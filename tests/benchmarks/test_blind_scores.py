"""Scores of one case: classes and sets, with effects of a class counted once."""

import pytest
from benchmarks.blind.label import NONE, OUTSIDE, Cause, Label
from benchmarks.blind.scored_case import ScoredCase
from stub_diagnosers import answer

CHANCES = {
    "thermal_expansion": 0.3,
    "thermal_zero_drift": 0.2,
    "ovality+thermal_expansion": 0.21,
    "ovality+thermal_zero_drift": 0.2,
    OUTSIDE: 0.05,
    NONE: 0.04,
}
THERMAL = Cause(("thermal_expansion", "thermal_zero_drift"), 0.91)
OVALITY = Cause(("ovality",), 0.41)


@pytest.mark.parametrize(
    ("truth", "classes", "first", "size"),
    [
        ("thermal_zero_drift", (OVALITY, THERMAL), True, 2),
        ("ovality", (OVALITY, THERMAL), False, 2),
        ("thermal_zero_drift", (), False, 4),
    ],
)
def test_effects_of_a_class_are_one(truth, classes, first, size):
    label = Label("case", "effect", (truth,), "rich", 9, 1.0, "iid", 0.0, 1.0)
    found = ScoredCase(label, answer("case", CHANCES, classes=classes))
    assert found.class_first is first
    assert found.merged_set == size
