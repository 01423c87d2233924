"""A cause is said as precisely as the data carry: effect, group, or neither."""

from types import SimpleNamespace

import numpy as np
import pytest

from hdcal.diagnosis import levels
from hdcal.diagnosis.groups import group_probabilities, leading_group, ranked_effects
from hdcal.diagnosis.model_posterior import ModelPosterior

LIBRARY = {
    "stick": SimpleNamespace(groups=("loop",)),
    "slip": SimpleNamespace(groups=("loop",)),
    "bend": SimpleNamespace(groups=("curve up",)),
    "gauge": SimpleNamespace(groups=("curve up", "curve down")),
    "wild": SimpleNamespace(groups=("noise",)),
}


def handmade(**share) -> ModelPosterior:
    share = {name.replace("__", "+"): value for name, value in share.items()}
    inclusion = {
        name: sum(p for n, p in share.items() if name in n.split("+"))
        for name in LIBRARY
    }
    return ModelPosterior(share, inclusion, np.ones(1), {})


@pytest.fixture
def word(monkeypatch):
    def ask(alike=(), *, carried=1.0, detected=True, doubt=False, minor=False, **share):
        posterior = handmade(**share)
        # What some effects close of the likeliest hypothesis, by their share of names.
        monkeypatch.setattr(
            levels,
            "closed_by",
            lambda _, hypothesis, names: (
                carried if any(n in names for n in hypothesis) else 0.0
            ),
        )
        monkeypatch.setattr(levels, "leaves_most", lambda *_: minor)
        return levels.verdict_word(
            SimpleNamespace(on_noise=("wild",)),
            SimpleNamespace(posterior=posterior, detected=detected),
            LIBRARY,
            ranked_effects(posterior, ("wild",))[0],
            leading_group(posterior, LIBRARY, alike),
            rival=bool(alike),
            doubt=doubt,
        )

    return ask


SURE = {"none": 0.01, "unknown": 0.01, "stick": 0.98}


def test_a_sure_effect_is_named(word):
    assert word(**SURE) == "named"
    assert word(none=0.01, unknown=0.01, stick=0.5, stick__unknown=0.48) == "named"
    assert word(none=0.01, unknown=0.01, stick__wild=0.98) == "named"
    # A name needs more than its group.
    assert word(none=0.02, unknown=0.02, stick=0.96) == "group"


def test_without_a_gap_nothing_is(word):
    assert word(detected=False, **SURE) == "none"
    assert word(none=0.5, unknown=0.0, stick=0.5) == "none"
    assert word(none=0.1, unknown=0.5, stick=0.4) == "unknown"


def test_two_that_are_alike_are_a_group(word):
    assert word(none=0.02, unknown=0.03, stick=0.5, slip=0.45) == "group"
    assert word(none=0.02, unknown=0.3, stick=0.38, slip=0.3) == "ambiguous"
    assert word(none=0.02, unknown=0.03, stick=0.5, bend=0.45) == "ambiguous"


def test_a_pair_of_one_group_names_neither(word):
    assert word(none=0.01, unknown=0.01, slip__stick=0.98) == "group"
    assert word(none=0.01, unknown=0.01, bend__stick=0.98) == "named"


def test_a_rival_that_cannot_be_excluded_is_not(word):
    assert word((("slip", "stick"),), **SURE) == "group"
    # Of another group: both are said together.
    assert word((("bend", "stick"),), **SURE) == "group"
    posterior = handmade(**SURE)
    found = leading_group(posterior, LIBRARY, (("bend", "stick"),))
    assert found is not None
    assert found.name == "loop / curve up"
    assert found.members == ("stick", "slip", "bend")


def test_what_leaves_more_than_noise_is_said_one_level_less(word):
    assert word(doubt=True, **SURE) == "group"
    assert word(doubt=True, none=0.0, unknown=0.05, stick=0.5, slip=0.45) == "ambiguous"
    assert word(doubt=True, none=0.0, unknown=0.05, wild=0.95) == "ambiguous"


def test_what_does_not_carry_the_gap_is_no_cause(word):
    assert word(carried=0.6, **SURE) == "ambiguous"
    assert word(carried=0.8, **SURE) == "named"


def test_of_what_leaves_most_of_the_gap_nothing_is_said(word):
    assert word(minor=True, **SURE) == "ambiguous"
    assert word(minor=True, none=0.02, unknown=0.03, stick=0.5, slip=0.45) == (
        "ambiguous"
    )


def test_groups_add_up_what_holds_a_member():
    found = group_probabilities(
        handmade(none=0.1, unknown=0.1, gauge=0.3, bend=0.2, bend__stick=0.3), LIBRARY
    )
    expected = {"loop": 0.3, "curve up": 0.8, "curve down": 0.3, "noise": 0.0}
    assert found == pytest.approx(expected)
