"""Counts of right and wrong names limit which effects a diagnosis names."""

import pytest
from diagnosis_cases import judged, rich, simulated
from scipy.stats import binom

from hdcal.diagnosis import which
from hdcal.diagnosis.naming import Naming, Tally, naming
from hdcal.physics.registry import EFFECTS


def test_no_larger_share_is_as_likely_as_the_confidence_leaves():
    for tally in (Tally(199, 8), Tally(30, 0), Tally(5, 4)):
        assert binom.cdf(tally.wrong, tally.said, tally.at_most) == pytest.approx(0.05)
    assert Tally(4, 4).at_most == 1.0


def test_what_was_counted_is_of_effects_of_the_library():
    counted = naming()
    assert counted.called.keys() <= EFFECTS.keys()
    assert all(0 <= t.wrong <= t.said for t in counted.called.values())
    # Of an effect that nobody has counted nothing is known.
    assert counted.may_be_named("own_effect")
    # Of a few cases it is enough that all of them were others.
    few = Naming({"a": Tally(3, 3), "b": Tally(3, 0)}, Tally(0, 0), Tally(0, 0))
    assert few.may_be_named("b") and not few.may_be_named("a")


def with_counts(monkeypatch, wrong: int):
    counted = Naming(
        {"coulomb_friction": Tally(20, wrong)}, Tally(100, 2), Tally(200, 3)
    )
    monkeypatch.setattr(which, "naming", lambda: counted)
    case = simulated(rich(), {"coulomb_friction": {"force": 1.5}}, seed=2)
    return judged(case)


def test_a_name_that_others_get_too_often_is_not_given(monkeypatch):
    sure, doubtful = (with_counts(monkeypatch, wrong) for wrong in (1, 8))
    one, two = sure.which, doubtful.which
    assert one.verdict == "named" and not one.describes_best
    assert (one.lookalike_cases, one.lookalike_rate) == (20, 0.05)
    assert (one.certificate.said, one.certificate.wrong) == (100, 2)
    assert two.verdict == "group" and two.describes_best
    assert (two.effect, two.group) == ("coulomb_friction", "loop")
    assert (two.certificate.said, two.certificate.wrong) == (200, 3)
    # Neither moves a probability.
    assert one.probabilities == two.probabilities


@pytest.mark.thorough
def test_of_two_effects_each_has_to_be_one_that_may_be_named(monkeypatch):
    """Neither alone describes it then, and both are said."""
    slow = {"share": 0.09, "time_constant": 30.0}
    two = {"coulomb_friction": {"force": 4.0}, "relaxation": slow}
    library = {name: EFFECTS[name] for name in (*two, "outliers", "screw_error")}
    for wrong, word in ((0, "named"), (9, "group")):
        counted = Naming({"relaxation": Tally(20, wrong)}, *2 * [Tally(9, 1)])
        monkeypatch.setattr(which, "naming", lambda counted=counted: counted)
        found = judged(simulated(rich(), two, seed=1), library=library)
        assert {found.which.effect, found.which.second_effect} == two.keys()
        assert found.which.verdict == word and not found.which.describes_best
        # Counted was another library.
        assert found.which.certificate is None
