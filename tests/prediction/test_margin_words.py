"""A margin says first whether the capacity does."""

from dataclasses import replace

import pytest
from posteriors import batch

import hdcal
from hdcal.prediction.margin.budget_words import coverage_words
from hdcal.prediction.margin.number_words import chance, newtons_down
from hdcal.prediction.margin.stated import BudgetCheck
from hdcal.quantities import FORCE


@pytest.mark.thorough
def test_far_outside_no_bound_is_called_sure():
    gears = batch(6, 400)
    near, far = (hdcal.margin(gears, at, limit_force=400.0) for at in (0.6, 0.9))
    assert near.beyond_tested == pytest.approx(0.06 / 0.52)
    assert far.beyond_tested == pytest.approx(0.36 / 0.52)
    assert (near.basis, far.basis) == ("A-basis", "")
    inside = hdcal.margin(gears, 0.4, limit_force=400.0)
    assert inside.beyond_tested == 0.0


def test_a_probability_has_no_more_digits_than_it_can_have():
    assert chance(0.990173) == "99.0 %"
    assert chance(0.999966) == "more than 99.9 %"
    assert chance(0.85) == "85 %"
    assert chance(0.98) == "98.0 %"
    assert chance(1.0 - 1e-16) == "more than 99.9 %"


def test_what_may_be_accepted_is_never_rounded_up():
    for value, words in (
        (88.85, "88.8 N"),
        (88.8, "88.8 N"),
        (5.6789, "5.678 N"),
        (0.05, "0.05 N"),
        (0.0, "0 N"),
        (-0.04567, "-0.04567 N"),
        (-88.85, "-88.9 N"),
        (23456.0, "2.345e+04 N"),
    ):
        assert FORCE.say(newtons_down(value)) == words


def test_a_law_of_very_many_degrees_of_freedom_is_called_normal():
    check = BudgetCheck(80.0, 1.7, 5e6, 1.96, 76.7, 83.3, 76.7, 83.3, 0.05, 0.01, "-")
    assert coverage_words(check) == "k = 1.96, normal"
    few = replace(check, degrees_of_freedom=13.5, coverage_factor=2.15)
    assert coverage_words(few) == "k = 2.15, Student t, 13.5 d.o.f."
