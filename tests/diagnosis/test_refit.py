"""Which hypotheses are calibrated, and who carries the probability of the rest."""

from types import SimpleNamespace

import numpy as np
import pytest
from rigs import cycles, make_case

from hdcal.diagnosis.refit import rows_to_calibrate, weighed


def calibrated(failing=(), widths=None):
    """Return a calibration that fails for some, and the list of what it was asked."""
    asked = []

    def run(name: str):
        asked.append(name)
        width = (widths or {}).get(name, 1.0)
        draws = {"stiffness": 200.0 + width * np.array([-1.0, 1.0])}
        return SimpleNamespace(usable=name not in failing, draws=draws, reasons=("no",))

    return run, asked


def shares(found) -> dict[str, float]:
    return {name: share for name, (share, _) in found.posteriors.items()}


def test_every_hypothesis_of_five_per_cent_is_kept_whatever_the_verdict():
    run, asked = calibrated()
    chances = {"none": 0.009, "a": 0.55, "a+b": 0.2, "c": 0.06, "unknown": 0.17}
    found = weighed(chances | {"d": 0.011}, run)
    # In whatever order: two are calibrated side by side.
    assert sorted(asked) == sorted(["a", "a+b", "unknown", "c"])
    assert sum(shares(found).values()) == pytest.approx(1.0)
    # 2 % and less is left out, said, and given to what bends wherever data let it.
    assert found.left_out.probability == pytest.approx(0.02)
    assert found.left_out.counted_as == "unknown"
    assert shares(found)["unknown"] == pytest.approx(0.19)
    assert shares(found)["a"] == 0.55


def test_more_than_two_per_cent_calls_for_the_unknown():
    """What the xb1 case leaves: 7 % that were renormalised away unsaid."""
    run, asked = calibrated()
    chances = {"a": 0.74, "b": 0.08, "none": 0.06, "unknown": 0.02}
    found = weighed(chances | dict.fromkeys("cdefghij", 0.0125), run)
    assert sorted(asked) == sorted(["a", "b", "none", "unknown"])
    assert found.left_out.probability == pytest.approx(0.1)
    assert shares(found)["unknown"] == pytest.approx(0.12)
    assert shares(found)["a"] == 0.74


def test_pairs_with_the_likeliest_effect_are_no_gap_without_it():
    chances = {"a": 0.7, "none": 0.06, "unknown": 0.06, "c": 0.02}
    chances |= {f"a+{name}": 0.04 for name in "defg"}
    run, asked = calibrated()
    found = weighed(chances, run)
    assert sorted(asked) == sorted(["a", "none", "unknown", "a+unknown"])
    assert found.left_out.counted_as == "a+unknown"
    expected = {"a": 0.7, "none": 0.06, "unknown": 0.06, "a+unknown": 0.18}
    assert shares(found) == pytest.approx(expected)
    # Where that model fails its checks, the plain one carries them.
    run, asked = calibrated(failing=("a+unknown",))
    found = weighed({**chances, "none": 0.12, "unknown": 0.0}, run)
    assert sorted(asked) == sorted(["a", "none", "a+unknown", "unknown"])
    assert found.left_out.counted_as == "unknown"
    # Whether the effect stands first alone or not.
    run, _ = calibrated()
    chances = {"none": 0.45, "a": 0.35, **{f"a+{name}": 0.04 for name in "defgh"}}
    assert weighed(chances, run).left_out.counted_as == "a+unknown"
    run, _ = calibrated()
    chances = {"none": 0.45, "a": 0.35, **{name: 0.04 for name in "defgh"}}
    assert weighed(chances, run).left_out.counted_as == "unknown"
    # One that is calibrated anyway is asked once.
    run, asked = calibrated()
    found = weighed({"a": 0.75, "a+unknown": 0.1, "a+c": 0.04, "a+d": 0.11}, run)
    assert sorted(asked) == sorted(["a", "a+d", "a+unknown"])
    assert shares(found)["a+unknown"] == pytest.approx(0.14)


def test_two_per_cent_and_less_goes_to_the_widest():
    run, asked = calibrated(widths={"a": 1.0, "b": 3.0})
    found = weighed({"a": 0.9, "b": 0.085, "unknown": 0.01, "none": 0.005}, run)
    assert sorted(asked) == sorted(["a", "b"])
    assert found.left_out.counted_as == "b"
    assert shares(found) == pytest.approx({"a": 0.9, "b": 0.1})


def test_what_fails_its_checks_is_left_out_not_shared_out():
    run, asked = calibrated(failing=("a",))
    found = weighed({"a": 0.3, "b": 0.7, "unknown": 0.0, "none": 0.0}, run)
    assert sorted(asked) == sorted(["b", "a", "unknown"])
    assert {*found.failed} == {"a"}
    assert found.left_out.probability == pytest.approx(0.3)
    assert shares(found) == pytest.approx({"b": 0.7, "unknown": 0.3})
    run, _ = calibrated(failing=("a", "b", "unknown"))
    nothing = weighed({"a": 0.3, "b": 0.7, "unknown": 0.0, "none": 0.0}, run)
    assert not nothing.posteriors and nothing.left_out is None


def test_of_many_small_ones_the_likeliest_is_kept():
    run, asked = calibrated()
    chances = {f"e{i}": 0.03 for i in range(32)} | {"unknown": 0.0, "none": 0.04}
    found = weighed(chances, run)
    assert sorted(asked) == sorted(["none", "unknown"])
    assert shares(found) == pytest.approx({"none": 0.04, "unknown": 0.96})


def test_of_a_long_log_some_single_rows_are_calibrated_on_and_the_turns_kept():
    long = make_case(cycles(12_000))
    few = rows_to_calibrate(long)
    assert 3_000 <= len(few.records.force) <= 5_100
    assert set(np.asarray(few.records.force)) <= set(np.asarray(long.records.force))
    assert np.max(few.records.deformation) == np.max(long.records.deformation)
    assert len(few.notes) == len(long.notes) + 1
    short = make_case(cycles(102))
    assert rows_to_calibrate(short) is short
