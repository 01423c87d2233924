"""Which hypotheses are calibrated, and which model stands for the others."""

from types import SimpleNamespace

import numpy as np
import pytest
from rigs import cycles, make_case

from hdcal.diagnosis.refit import rows_to_calibrate, weighed


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
SINGLES = dict.fromkeys("defgh", 0.02)
# Chances, calibrations that fail, widths; what is calibrated, the shares of the models,
# and which of them stands for the others.
CASES = {
    "5 % and more": (
        (
            {
                "none": 0.009,
                "a": 0.55,
                "a+b": 0.2,
                "c": 0.06,
                "unknown": 0.17,
                "d": 0.011,
            },
        ),
        {"a": 0.55, "a+b": 0.2, "c": 0.06, "unknown": 0.19},
        "unknown",
    ),
    "more than 2 % left": (
        ({"a": 0.74, "b": 0.08, "none": 0.06, "unknown": 0.02, **SINGLES},),
        {"a": 0.74, "b": 0.08, "none": 0.06, "unknown": 0.12},
        "unknown",
    ),
    "pairs with the likeliest": (
        ({"a": 0.7, "none": 0.06, "unknown": 0.06, "c": 0.02, **PAIRS},),
        {"a": 0.7, "none": 0.06, "unknown": 0.06, "a+unknown": 0.18},
        "a+unknown",
    ),
    "their model fails": (
        ({"a": 0.7, "none": 0.12, "c": 0.02, **PAIRS}, ("a+unknown",)),
        {"a": 0.7, "none": 0.12, "unknown": 0.18},
        "unknown",
    ),
    "none is likelier": (
        ({"none": 0.49, "a": 0.35, **PAIRS},),
        {"none": 0.49, "a": 0.35, "a+unknown": 0.16},
        "a+unknown",
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
    "a failure": (
        ({"a": 0.3, "b": 0.7}, ("a",)),
        {"b": 0.7, "unknown": 0.3},
        "unknown",
    ),
    "many small ones": (
        ({**{f"e{i}": 0.03 for i in range(32)}, "none": 0.04},),
        {"none": 0.04, "unknown": 0.96},
        "unknown",
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
    assert sorted(names) == sorted({*shares, *found.failed})


def test_nothing_is_left_where_all_calibrations_fail():
    found, _ = fits({"a": 0.3, "b": 0.7}, ("a", "b", "unknown"))
    assert not found.posteriors and found.left_out is None
    assert len(found.failures) == 3


def test_long_logs_are_calibrated_on_single_rows_that_hold_the_turns():
    long = make_case(cycles(12_000))
    few = rows_to_calibrate(long)
    assert 3_000 <= len(few.records.force) <= 5_100
    assert set(np.asarray(few.records.force)) <= set(np.asarray(long.records.force))
    assert np.max(few.records.deformation) == np.max(long.records.deformation)
    assert len(few.notes) == len(long.notes) + 1
    short = make_case(cycles(102))
    assert rows_to_calibrate(short) is short
