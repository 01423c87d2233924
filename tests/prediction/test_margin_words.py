"""A margin says first whether the capacity does."""

from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from posteriors import batch, single

import hdcal
from hdcal.prediction.margin.budget_words import coverage_words, stated_words
from hdcal.prediction.margin.number_words import chance, newtons_down
from hdcal.prediction.margin.sentences import answer, headline
from hdcal.prediction.margin.stated import BudgetCheck


@pytest.fixture(scope="module")
def posterior():
    return single(size=400)


def verdict(posterior, limit: float) -> str:
    found = hdcal.margin(posterior, 0.4, limit_force=limit)
    (said,) = (words for words in answer(found) if words.startswith("A capacity of"))
    assert said == headline(found)
    return said


def test_enough_not_surely_and_not(posterior):
    level = hdcal.margin(posterior, 0.4).worst
    sure, middle = level.capacity_N, level.capacity_median_N
    assert middle < sure
    assert "is enough for 99 % of readings" in verdict(posterior, sure + 0.1)
    between = verdict(posterior, 0.5 * (sure + middle))
    assert "more likely than not" in between and "but not with 95 %" in between
    assert "is NOT enough" in verdict(posterior, middle - 0.1)


def test_the_surer_capacity_is_never_the_smaller_one(posterior):
    """Far outside a few draws make the average: it may lie above the sure one."""
    found = hdcal.margin(posterior, 0.9, content=0.999)
    level = found.worst
    assert level.capacity_N < level.capacity_predictive_N
    assert level.capacity_median_N < level.capacity_N
    (said,) = (words for words in answer(found) if words.startswith("To hold"))
    assert f"{level.capacity_median_N:.1f} N is as likely as not to do" in said
    assert f"{level.capacity_N:.1f} N does with 95 % confidence" in said


@pytest.mark.thorough
def test_far_outside_no_bound_is_called_sure():
    gears = batch(6, 400)
    near, far = (hdcal.margin(gears, at, limit_force=400.0) for at in (0.6, 0.9))
    assert near.beyond_tested == pytest.approx(0.06 / 0.52)
    assert far.beyond_tested == pytest.approx(0.36 / 0.52)
    assert (near.basis, far.basis) == ("A-basis", "")
    assumed = "if nothing but the assumed bend"
    assert assumed in headline(far) and assumed not in headline(near)
    bare = hdcal.margin(gears, 0.9, sensitivities=False)
    assert assumed in headline(bare) and bare.limit_force_N is None
    assert "test there before you rely on it" in far.extrapolated[0]
    assert "rely on it" not in near.extrapolated[0]
    inside = hdcal.margin(gears, 0.4, limit_force=400.0)
    assert inside.beyond_tested == 0.0 and assumed not in headline(inside)


def test_a_zero_that_only_the_prior_knows_is_named(posterior):
    diagnoses = dict(posterior.diagnoses)
    diagnoses["force_offset"] = replace(diagnoses["force_offset"], driven_by="prior")
    known = replace(posterior, diagnoses=diagnoses)
    sd = np.std(posterior.draws["force_offset"])
    words = f"known to {sd:.2g} N (sd)"
    found = hdcal.margin(known, 0.4, quantity="load", sensitivities=False)
    assert any(words in said for said in found.remarks)
    for other in (
        hdcal.margin(posterior, 0.4, quantity="load", sensitivities=False),
        hdcal.margin(known, 0.4, sensitivities=False),
    ):
        assert not any(words in said for said in other.remarks)


def test_a_notebook_shows_the_answer(posterior):
    found = hdcal.margin(posterior, 0.4, limit_force=120.0, temperature=60.0)
    shown = found._repr_html_()
    assert headline(found) in shown and found.extrapolated[0] in unescape(shown)
    assert "<script" not in shown and "<html" not in shown


def test_a_probability_has_no_more_digits_than_it_can_have():
    assert chance(0.990173) == "99.0 %"
    assert chance(0.999966) == "more than 99.9 %"
    assert chance(0.85) == "85 %"
    assert chance(0.98) == "98.0 %"
    assert chance(1.0 - 1e-16) == "more than 99.9 %"


def test_the_stated_probability_belongs_to_its_index(posterior):
    """Also where a few draws make all of it, and the interval of the share none."""
    at = hdcal.margin(posterior, 0.4, quantity="load").worst.force_N
    rare = at.hi + 0.02 * (at.hi - at.median)
    found = hdcal.margin(posterior, 0.4, quantity="load", limit_force=rare)
    risk = found.worst.exceedance
    assert risk.hi < 1e-12 < risk.probability
    (said,) = (words for words in answer(found) if words.startswith("One future"))
    assert f"a probability of {chance(risk.probability)}" in said
    assert f"{risk.beta:.2f}" in said


def test_what_nobody_can_know_is_said_once(posterior):
    found = hdcal.margin(posterior, 0.4, limit_force=84.0, sensitivities=False)
    risk = replace(found.worst.exceedance, lo=1e-14, at_confidence=1e-13)
    rare = replace(found, worst=replace(found.worst, exceedance=risk))
    (said,) = (words for words in answer(rare) if words.startswith("One future"))
    assert f"is at most {chance(risk.hi)} (95" in said
    assert "confidence it is less than 1e-12" in said


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
        assert newtons_down(value) == words


def test_an_uncertainty_is_never_rounded_down(posterior):
    found = hdcal.margin(posterior, 0.4)
    for size, words in ((1.146, "1.2"), (1.2, "1.2"), (0.0801, "0.081"), (0.0, "0")):
        said = stated_words(replace(found, expanded_uncertainty_N=size))
        assert f"± {words} N" in said


def test_a_law_of_very_many_degrees_of_freedom_is_called_normal():
    check = BudgetCheck(80.0, 1.7, 5e6, 1.96, 76.7, 83.3, 76.7, 83.3, 0.05, 0.01, "-")
    assert coverage_words(check) == "k = 1.96, normal"
    few = replace(check, degrees_of_freedom=13.5, coverage_factor=2.15)
    assert coverage_words(few) == "k = 2.15, Student t, 13.5 d.o.f."
