"""The verdict follows from the probabilities by stated rules."""

import numpy as np
import pytest

import hdcal
from hdcal.diagnosis.library import choose_library, library_of
from hdcal.diagnosis.model_posterior import (
    ModelPosterior,
    log_priors,
    model_posterior,
)
from hdcal.errors import InputError
from hdcal.physics.registry import EFFECTS


def handmade(**share) -> ModelPosterior:
    """Return a hand-made posterior; what is not said of the names is inferred."""
    share = {name.replace("__", "+"): value for name, value in share.items()}
    effects = {p for n in share for p in n.split("+")} - {"none", "unknown"}
    inclusion = {
        effect: sum(v for n, v in share.items() if effect in n.split("+"))
        for effect in sorted(effects)
    }
    return ModelPosterior(share, inclusion, np.ones(1), {})


def test_the_smallest_set_holds_ninety_per_cent():
    found = handmade(none=0.05, unknown=0.02, a=0.6, b=0.2, a__c=0.13)
    assert found.smallest_set == ("a", "b", "c")
    assert handmade(none=0.05, unknown=0.01, a=0.94).smallest_set == ("a",)
    assert handmade(none=0.2, unknown=0.0, a=0.8).smallest_set == ("a", "none")


def test_a_remainder_is_no_cause_of_its_own():
    found = handmade(none=0.05, unknown=0.01, a__unknown=0.94)
    assert found.smallest_set == ("a",)
    assert handmade(none=0.05, unknown=0.55, a=0.4).smallest_set == ("unknown", "a")


def test_priors_sum_to_one_and_groups_keep_their_share():
    names = ["none", "unknown", "a", "b", "c", "a+b", "a+c", "b+c"]
    names += ["a+unknown", "b+unknown", "c+unknown"]
    prior = dict(zip(names, np.exp(log_priors(names)), strict=True))
    assert sum(prior.values()) == pytest.approx(1.0)
    assert prior["none"] == pytest.approx(0.5)
    assert prior["unknown"] == pytest.approx(0.1)
    rest = sum(v for n, v in prior.items() if n.endswith("+unknown"))
    assert rest == pytest.approx(0.15)
    pairs = sum(v for n, v in prior.items() if "+" in n) - rest
    assert pairs == pytest.approx(0.03)
    assert prior["a"] == pytest.approx(prior["b"])


def test_noise_has_its_odds_beside_whatever_goes_on_in_the_mean():
    names = ["none", "unknown", "a", "b", "a+b", "a+unknown", "n"]
    names += ["n+unknown", "a+n", "b+n"]
    prior = dict(zip(names, np.exp(log_priors(names, ["n"])), strict=True))
    assert sum(prior.values()) == pytest.approx(1.0)
    for alone, beside in (("none", "n"), ("unknown", "n+unknown"), ("a", "a+n")):
        assert prior[beside] == pytest.approx(0.02 * prior[alone])
    # No remainder was looked for beside b: half of that prior is unused.
    assert prior["a+unknown"] == pytest.approx(0.15 * prior["none"])


def test_an_effect_that_does_not_carry_the_gap_is_only_in_the_way():
    table = {"none": [0.0], "unknown": [1.0], "a": [-50.0], "a+unknown": [9.0]}
    table = {name: np.array(value) for name, value in table.items()}
    whole, half = model_posterior(table), model_posterior(table, {"a": 0.25})
    share = whole.probabilities["a+unknown"]
    assert half.probabilities["a+unknown"] == pytest.approx(0.25 * share)
    moved = half.probabilities["unknown"] - whole.probabilities["unknown"]
    assert moved == pytest.approx(0.75 * share)
    assert half.inclusion["a"] == pytest.approx(0.25 * whole.inclusion["a"])


def test_a_pair_whose_second_is_not_seen_is_the_first_alone():
    table = {name: np.zeros(1) for name in ("none", "unknown", "a", "b", "a+b")}
    whole = model_posterior(table).probabilities
    moved = model_posterior(table, unseen={"a+b": {"a": 0.6, "b": 0.15}})
    assert moved.probabilities["a+b"] == pytest.approx(0.25 * whole["a+b"])
    for name, chance in (("a", 0.6), ("b", 0.15)):
        gained = moved.probabilities[name] - whole[name]
        assert gained == pytest.approx(chance * whole["a+b"])
    assert moved.inclusion["b"] == pytest.approx(whole["b"] + 0.4 * whole["a+b"])


def test_weighing_is_bayes_rule():
    """By hand, with two correlations that are equally probable."""
    names = ["none", "unknown", "a", "b", "a+b"]
    rng = np.random.default_rng(0)
    table = {name: rng.normal(-40.0, 2.0, 2) for name in names}
    prior = np.exp(log_priors(names))
    joint = prior[:, None] * np.exp(np.stack([table[n] for n in names]))
    joint /= joint.sum()
    found = model_posterior(table)
    expected = dict(zip(names, joint.sum(axis=1), strict=True))
    assert found.probabilities == pytest.approx(expected)
    np.testing.assert_allclose(found.correlation, joint.sum(axis=0))
    both = expected["a"] + expected["a+b"]
    assert found.inclusion["a"] == pytest.approx(both)
    shifted = model_posterior({name: value + 500.0 for name, value in table.items()})
    assert shifted.probabilities == pytest.approx(found.probabilities)


def test_effects_are_withheld_by_name():
    assert choose_library() == EFFECTS
    found = choose_library("minus:hysteresis, ovality")
    assert set(EFFECTS) - set(found) == {"hysteresis", "ovality"}


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("minus:histeresis", "Did you mean 'hysteresis'"),
        ("minus:zzz", "The library holds"),
        ("hysteresis", "minus:NAME"),
    ],
)
def test_a_slip_of_the_pen_is_explained(spec, words):
    with pytest.raises(InputError) as raised:
        choose_library(spec)
    assert words in str(raised.value)


def test_no_library_is_the_whole_one():
    assert library_of(None) == EFFECTS
    part = {"ovality": EFFECTS["ovality"]}
    assert library_of(part) == part


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["ovality"], "is no mapping"),
        ({"ovality": 3}, "'ovality' is no class of an effect"),
        ({"ovality": int}, "'ovality' is no class of an effect"),
    ],
)
@pytest.mark.parametrize("ask", [hdcal.diagnose, hdcal.causes])
def test_what_is_no_library_is_said(ask, given, words):
    x = [0.1, 0.2, 0.3, 0.4, 0.5]
    case = hdcal.read_case({"deformation_mm": x, "force_N": [9.0 * one for one in x]})
    with pytest.raises(InputError, match=f"library: {words}"):
        ask(case, library=given)


def test_every_wrong_name_is_reported_at_once():
    with pytest.raises(InputError) as raised:
        choose_library("minus:histeresis,ovalty")
    assert len(raised.value.findings) == 2
